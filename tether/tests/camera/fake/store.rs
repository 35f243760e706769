//! The memory card and the camera's own memory.

use super::dataset::ObjectInfo;

/// The card, as the host names it.
pub(super) const CARD: u32 = 0x0001_0001;
/// The picture in the camera's own memory.
pub(super) const IN_MEMORY: u32 = 0xFFFF_0001;
const ROOT: u32 = 0xFFFF_FFFF;

struct Object {
    handle: u32,
    info: ObjectInfo,
    file: Vec<u8>,
}

/// What the camera holds.
pub(super) struct Store {
    objects: Vec<Object>,
    taken: u32,
}

/// DCIM and the folder in it that pictures go to.
const DCIM: u32 = 1;
const PICTURES: u32 = 2;

impl Store {
    pub(super) fn new() -> Self {
        let folder = |handle, parent, name| Object {
            handle,
            info: ObjectInfo::folder(CARD, parent, name),
            file: Vec::new(),
        };
        Self {
            objects: vec![folder(DCIM, 0, "DCIM"), folder(PICTURES, DCIM, "100D5100")],
            taken: 0,
        }
    }

    /// Keeps a new picture; its handle.
    pub(super) fn add(&mut self, file: Vec<u8>, jpeg: bool, on_card: bool) -> u32 {
        self.taken += 1;
        let name = format!("DSC_{:04}.{}", self.taken, if jpeg { "JPG" } else { "NEF" });
        let (handle, storage, parent) =
            if on_card { (0x100 + self.taken, CARD, PICTURES) } else { (IN_MEMORY, 0, 0) };
        self.objects.retain(|object| object.handle != handle);
        let info = ObjectInfo::picture(storage, parent, &name, file.len());
        self.objects.push(Object { handle, info, file });
        handle
    }

    fn find(&self, handle: u32) -> Option<&Object> {
        self.objects.iter().find(|object| object.handle == handle)
    }

    pub(super) fn info(&self, handle: u32) -> Option<Vec<u8>> {
        self.find(handle).map(|object| object.info.encode())
    }

    /// `length` bytes from `offset`, or what there is of them.
    pub(super) fn part(&self, handle: u32, offset: usize, length: usize) -> Option<Vec<u8>> {
        let file = &self.find(handle)?.file;
        let from = offset.min(file.len());
        Some(file[from..offset.saturating_add(length).min(file.len())].to_vec())
    }

    pub(super) fn delete(&mut self, handle: u32) -> bool {
        let before = self.objects.len();
        self.objects.retain(|object| object.handle != handle);
        self.objects.len() < before
    }

    /// Handles on the card: of the root, of a folder, or (0) all.
    pub(super) fn handles(&self, parent: u32) -> Vec<u32> {
        let wanted = |object: &&Object| match parent {
            0 => true,
            ROOT => object.info.parent == 0,
            folder => object.info.parent == folder,
        };
        let on_card = self.objects.iter().filter(|object| object.info.storage == CARD);
        on_card.filter(wanted).map(|object| object.handle).collect()
    }
}
