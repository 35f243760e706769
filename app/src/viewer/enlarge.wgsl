// A picture over all of a view, smoothly enlarged.

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;

struct Corner {
    @builtin(position) position: vec4f,
    @location(0) at: vec2f,
}

@vertex
fn corner(@builtin(vertex_index) k: u32) -> Corner {
    let at = vec2f(f32(k & 1u), f32(k >> 1u));
    return Corner(vec4f(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y, 0.0, 1.0), at);
}

@fragment
fn fragment(corner: Corner) -> @location(0) vec4f {
    return textureSampleLevel(picture, smooth_sampler, corner.at, 0.0);
}
