//! Tiles on the graphics card: as many as are seen and some more, the longest unseen making room.

use crate::viewer::pyramid::{Place, Pyramid, SLOT, Texel};
use eframe::egui_wgpu::wgpu;
use std::collections::HashMap;
use std::sync::{Arc, Weak};

/// Bytes of a tile on the card.
pub const TILE_BYTES: usize = SLOT * SLOT * size_of::<Texel>();
/// A pool grows by so many tiles, so that a window that is being enlarged does not need a new one every frame.
const STEP: usize = 32;
/// Most tiles that a pool holds: what every card offers as layers of one texture.
const MOST: usize = 256;

/// A texture of many layers, each a tile.
#[derive(Debug)]
pub(super) struct Pool {
    texture: wgpu::Texture,
    slots: Vec<Slot>,
    index: HashMap<Key, usize>,
}

/// A picture and a place in it. The picture is known by its address, which stays its own for as long as a slot remembers it.
type Key = (usize, Place);

#[derive(Debug)]
struct Slot {
    key: Key,
    /// Keeps the address from being used again, and nothing else.
    _picture: Weak<Pyramid>,
    used: u64,
}

/// Where a tile's texels are, as the shader wants it: layer (negative: none), left and top, texels per pixel.
pub(super) type Locator = [f32; 4];

pub(super) const NOWHERE: Locator = [-1.0, 0.0, 0.0, 1.0];

impl Pool {
    /// A pool of one tile, for pictures that are not there.
    pub(super) fn empty(device: &wgpu::Device) -> Self {
        Self { texture: texture(device, 1), slots: Vec::new(), index: HashMap::new() }
    }

    /// Makes room for `wanted` tiles at once. True where the texture is another, empty one now.
    pub(super) fn reserve(&mut self, device: &wgpu::Device, wanted: usize) -> bool {
        if wanted.min(MOST) <= self.capacity() {
            return false;
        }
        let capacity = wanted.next_multiple_of(STEP).min(MOST);
        *self = Self { texture: texture(device, capacity), ..Self::empty(device) };
        true
    }

    /// All layers.
    pub(super) fn view(&self) -> wgpu::TextureView {
        self.texture.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..Default::default()
        })
    }

    /// Where the tile at `place` is, or the nearest coarser one that is there.
    pub(super) fn find(
        &mut self,
        picture: &Arc<Pyramid>,
        place: Place,
        now: u64,
    ) -> Option<Locator> {
        let coarser = std::iter::successors(Some(place), |place| Some(place.parent()));
        for place in coarser.take_while(|place| place.level <= picture.coarsest()) {
            if let Some(layer) = self.index.get(&key(picture, place)).copied() {
                self.slots[layer].used = now;
                return Some(locator(layer, place));
            }
        }
        None
    }

    /// Whether a tile is there; it counts as seen.
    pub(super) fn holds(&mut self, picture: &Arc<Pyramid>, place: Place, now: u64) -> bool {
        let layer = self.index.get(&key(picture, place)).copied();
        layer.is_some_and(|layer| {
            self.slots[layer].used = now;
            true
        })
    }

    /// Puts a tile there; nothing where all that is there is being seen.
    pub(super) fn put(
        &mut self,
        queue: &wgpu::Queue,
        picture: &Arc<Pyramid>,
        place: Place,
        now: u64,
        texels: &mut Vec<Texel>,
    ) {
        let Some(layer) = self.layer_to_fill(now) else { return };
        picture.cut(place, texels);
        let side = SLOT as u32;
        queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                texture: &self.texture,
                mip_level: 0,
                origin: wgpu::Origin3d { x: 0, y: 0, z: layer as u32 },
                aspect: wgpu::TextureAspect::All,
            },
            bytemuck::cast_slice(texels),
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(side * size_of::<Texel>() as u32),
                rows_per_image: Some(side),
            },
            wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 1 },
        );
        let key = key(picture, place);
        let slot = Slot { key, _picture: Arc::downgrade(picture), used: now };
        match layer < self.slots.len() {
            true => {
                self.index.remove(&self.slots[layer].key);
                self.slots[layer] = slot;
            }
            false => self.slots.push(slot),
        }
        self.index.insert(key, layer);
    }

    fn layer_to_fill(&self, now: u64) -> Option<usize> {
        if self.slots.len() < self.capacity() {
            return Some(self.slots.len());
        }
        let unseen = self.slots.iter().enumerate().filter(|(_, slot)| slot.used < now);
        unseen.min_by_key(|(_, slot)| slot.used).map(|(layer, _)| layer)
    }

    fn capacity(&self) -> usize {
        self.texture.depth_or_array_layers() as usize
    }
}

fn key(picture: &Arc<Pyramid>, place: Place) -> Key {
    (Arc::as_ptr(picture) as usize, place)
}

fn locator(layer: usize, place: Place) -> Locator {
    let texels = crate::viewer::pyramid::TILE as f32;
    let per_pixel = 0.5_f32.powi(place.level as i32);
    [layer as f32, place.x as f32 * texels, place.y as f32 * texels, per_pixel]
}

fn texture(device: &wgpu::Device, layers: usize) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("tiles"),
        size: wgpu::Extent3d {
            width: SLOT as u32,
            height: SLOT as u32,
            depth_or_array_layers: layers as u32,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba16Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}
