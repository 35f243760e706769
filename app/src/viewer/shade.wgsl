// Maps of a cloth, one quad per tile. The plain reference of `relit` is `shade.rs`.

struct View {
    // centre of the screen in the picture (pixels from its top left corner), and from pixels to clip space
    frame: vec4f,
    // screen pixels per pixel, divider in clip space, compose, whether the target encodes sRGB itself
    screen: vec4f,
    // mode of the first and of the second side, gain, further gain of pictures
    modes: vec4f,
    // width and height of the picture, pixels
    size: vec4f,
    // position of a point light (mm) and 1, or direction of a far one and 0
    lamp: vec4f,
    // beam's axis and exponent
    axis: vec4f,
    // intensity, -
    colour: vec4f,
    // gloss, shininess, -, -
    finish: vec4f,
    // upper ends of the scales: expected error, slope, angle, residual
    scales: vec4f,
    // the camera's place (mm), upper end of the scale of differences
    eye: vec4f,
    // what is behind the picture, sRGB
    ground: vec4f,
    // points of the plane on a grid over the picture, mm
    grid: array<vec4f, 289>,
}

const NODES = 17;

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var smooth_sampler: sampler;
@group(0) @binding(2) var scales: texture_2d<f32>;
@group(0) @binding(3) var surface_tiles: texture_2d_array<f32>;
@group(0) @binding(4) var albedo_tiles: texture_2d_array<f32>;
@group(0) @binding(5) var first_tiles: texture_2d_array<f32>;
@group(0) @binding(6) var second_tiles: texture_2d_array<f32>;

// Where a tile's texels are: layer (negative: none), left and top in texels of its level, texels per pixel.
struct Instance {
    @location(0) rect: vec4f,
    @location(1) surface: vec4f,
    @location(2) albedo: vec4f,
    @location(3) first: vec4f,
    @location(4) second: vec4f,
}

struct Corner {
    @builtin(position) position: vec4f,
    @location(0) pixel: vec2f,
    @location(1) clip_x: f32,
    @location(2) @interpolate(flat) surface: vec4f,
    @location(3) @interpolate(flat) albedo: vec4f,
    @location(4) @interpolate(flat) first: vec4f,
    @location(5) @interpolate(flat) second: vec4f,
}

@vertex
fn corner(@builtin(vertex_index) k: u32, tile: Instance) -> Corner {
    let at = vec2f(f32(k & 1u), f32(k >> 1u));
    let pixel = mix(tile.rect.xy, tile.rect.zw, at);
    let clip = (pixel - view.frame.xy) * view.frame.zw;
    return Corner(vec4f(clip, 0.0, 1.0), pixel, clip.x, tile.surface, tile.albedo, tile.first, tile.second);
}

// A tile's texel at a place of the picture: smooth from afar, a clear square from near.
fn texel(tiles: texture_2d_array<f32>, place: vec4f, pixel: vec2f) -> vec4f {
    let texels = pixel * place.w;
    let magnified = max(view.screen.x / place.w, 1.0);
    let seam = floor(texels + 0.5);
    let sharp = seam + clamp((texels - seam) * magnified, vec2f(-0.5), vec2f(0.5));
    let inside = sharp - place.yz + 1.0;
    let value = textureSampleLevel(tiles, smooth_sampler, inside / 258.0, i32(max(place.x, 0.0)), 0.0);
    return select(value, vec4f(0.0), place.x < 0.0);
}

fn normal_of(value: vec4f) -> vec3f {
    let xy = value.xy / max(value.w, 1e-4);
    return vec3f(xy, sqrt(max(1.0 - dot(xy, xy), 0.0)));
}

fn point_mm(pixel: vec2f) -> vec3f {
    let at = clamp(pixel / view.size.xy, vec2f(0.0), vec2f(1.0)) * f32(NODES - 1);
    let cell = min(vec2i(at), vec2i(NODES - 2));
    let t = at - vec2f(cell);
    let k = cell.y * NODES + cell.x;
    let top = mix(view.grid[k].xyz, view.grid[k + 1].xyz, t.x);
    let bottom = mix(view.grid[k + NODES].xyz, view.grid[k + NODES + 1].xyz, t.x);
    return mix(top, bottom, t.y);
}

// Direction to the light times falloff and emission.
fn light_vector(point: vec3f) -> vec3f {
    if view.lamp.w == 0.0 {
        return view.lamp.xyz;
    }
    let to_light = view.lamp.xyz - point;
    let distance_mm = length(to_light);
    let cosine = -dot(view.axis.xyz, to_light) / max(distance_mm, 1e-6);
    if cosine <= 0.0 {
        return vec3f(0.0);
    }
    let metres = distance_mm / 1000.0;
    return to_light / distance_mm * pow(cosine, view.axis.w) / (metres * metres);
}

fn relit(normal: vec3f, albedo: vec3f, point: vec3f) -> vec3f {
    let light = light_vector(point);
    let shading = max(dot(normal, light), 0.0);
    var value = albedo * shading;
    if view.finish.x > 0.0 && shading > 0.0 {
        let half_way = normalize(normalize(light) + normalize(view.eye.xyz - point));
        let lobe = pow(max(dot(normal, half_way), 0.0), view.finish.y);
        value += view.finish.x * (view.finish.y + 8.0) / 25.13274 * lobe * shading;
    }
    return value * view.colour.rgb;
}

fn encode(linear: vec3f) -> vec3f {
    let value = clamp(linear, vec3f(0.0), vec3f(1.0));
    return select(1.055 * pow(value, vec3f(1.0 / 2.4)) - 0.055, 12.92 * value, value <= vec3f(0.0031308));
}

fn decode(encoded: vec3f) -> vec3f {
    return select(pow((encoded + 0.055) / 1.055, vec3f(2.4)), encoded / 12.92, encoded <= vec3f(0.04045));
}

fn scale_at(value: f32, row: f32) -> vec3f {
    let u = (clamp(value, 0.0, 1.0) * 255.0 + 0.5) / 256.0;
    return textureSampleLevel(scales, smooth_sampler, vec2f(u, (row + 0.5) / 2.0), 0.0).rgb;
}

struct MapArea {
    // sRGB
    colour: vec3f,
    // linear
    value: vec3f,
    covered: f32,
}

fn linear_side(value: vec3f, covered: f32) -> MapArea {
    let bright = value * view.modes.z;
    return MapArea(encode(bright), bright, covered);
}

fn coded_side(colour: vec3f, covered: f32) -> MapArea {
    return MapArea(colour, colour, covered);
}

fn side(mode: f32, surface: vec4f, albedo: vec4f, picture: vec4f, pixel: vec2f) -> MapArea {
    let normal = normal_of(surface);
    let picture_rgb = picture.rgb / max(picture.w, 1e-4);
    switch i32(mode) {
        case 0: { return coded_side(0.5 * normal + 0.5, surface.w); }
        case 1: { return linear_side(albedo.rgb / max(surface.w, 1e-4), surface.w); }
        case 2: { return coded_side(scale_at(surface.z / max(surface.w, 1e-4) / view.scales.x, 0.0), surface.w); }
        case 3: {
            // What was divided out of the albedo goes back in: w holds it, times the covered share.
            let seen = albedo.rgb * albedo.w / max(surface.w * surface.w, 1e-6);
            return linear_side(relit(normal, seen, point_mm(pixel)), surface.w);
        }
        case 4: { return coded_side(scale_at(degrees(acos(clamp(normal.z, -1.0, 1.0))) / view.scales.y, 0.0), surface.w); }
        case 5: { return linear_side(picture_rgb * view.modes.w, picture.w); }
        case 6: { return coded_side(scale_at(0.5 + 0.5 * picture_rgb.r / view.scales.w, 1.0), picture.w); }
        case 7: {
            let other = normal_of(picture);
            let angle = degrees(atan2(length(cross(normal, other)), dot(normal, other)));
            return coded_side(scale_at(angle / view.scales.z, 0.0), min(surface.w, picture.w));
        }
        default: { return coded_side(0.5 * normal_of(picture) + 0.5, picture.w); }
    }
}

fn over_ground(shown: MapArea) -> vec3f {
    return mix(view.ground.rgb, shown.colour, clamp(shown.covered, 0.0, 1.0));
}

@fragment
fn fragment(at: Corner) -> @location(0) vec4f {
    let surface = texel(surface_tiles, at.surface, at.pixel);
    let albedo = texel(albedo_tiles, at.albedo, at.pixel);
    let first_picture = texel(first_tiles, at.first, at.pixel);
    let second_picture = texel(second_tiles, at.second, at.pixel);
    let first = side(view.modes.x, surface, albedo, first_picture, at.pixel);
    var colour = over_ground(first);
    if view.screen.z > 0.5 {
        let second = side(view.modes.y, surface, albedo, second_picture, at.pixel);
        if view.screen.z < 1.5 {
            colour = select(colour, over_ground(second), at.clip_x > view.screen.y);
        } else {
            let apart = abs(first.value - second.value);
            let most = max(apart.r, max(apart.g, apart.b)) / view.eye.w;
            colour = over_ground(coded_side(scale_at(most, 0.0), min(first.covered, second.covered)));
        }
    }
    if view.screen.w > 0.5 {
        colour = decode(colour);
    }
    return vec4f(colour, 1.0);
}
