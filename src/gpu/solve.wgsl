// Plain and weighted least squares of photosites that have all their samples: what photometry/complete.rs says, one photosite
// an invocation and one piece of a row a workgroup. Where rounding might decide which way a photosite goes, nothing is
// decided here.
//
// y_i = l_i . g + noise: y_i the sample of light i, l_i its vector, g albedo times normal. Vectors are linear along a piece.

struct Settings {
    lights: u32,
    // Planes of samples a row: one a light, then the noise scale where there is one.
    planes: u32,
    pieces: u32,
    // Chi-square that a good fit stays below.
    limit: f32,
}

struct Piece {
    // Photosites of the tile before this row, and in it.
    before: u32,
    width: u32,
    // Columns of the row.
    start: u32,
    end: u32,
    // Of the picture's row: which two of the four noise models of a light are its.
    row_parity: u32,
}

// xx, xy, xz, yy, yz, zz of a symmetric matrix.
struct Symmetric {
    xx: f32, xy: f32, xz: f32,
    yy: f32, yz: f32,
    zz: f32,
}

struct Inverse {
    matrix: Symmetric,
    // Of the light vectors, squared (an upper bound within a factor of nine); very large where the matrix is not positive.
    condition_squared: f32,
}

@group(0) @binding(0) var<uniform> settings: Settings;
// Per light (256 of them: the least that a uniform buffer holds everywhere): shot, floor, kappa at the four places of the 2 x 2 cell. var(y) = shot y + floor + (kappa y)^2.
@group(0) @binding(1) var<uniform> noise: array<vec4<f32>, 1024>;
// Row by row, plane by plane; bits, because a number that is not one means that there is no sample.
@group(0) @binding(2) var<storage, read> samples: array<u32>;
@group(0) @binding(3) var<storage, read> pieces: array<Piece>;
// Per piece: N = (L^T L)^-1 at its first column and its growth per column, then the same of every light's vector.
@group(0) @binding(4) var<storage, read> coefficients: array<f32>;
// Row by row: g.x, g.y, g.z, variance across the normal, sum of squared residuals.
@group(0) @binding(5) var<storage, read_write> found: array<f32>;

const WORKGROUP: u32 = 32u;
const FOUND_PLANES: u32 = 5u;
const COEFFICIENTS_OF_INVERSE: u32 = 12u;
const COEFFICIENTS_OF_LIGHT: u32 = 6u;
// As in photometry/method.rs and photometry/weighted.rs.
const RELATIVE_FLOOR: f32 = 1e-5;
const WEIGHTED_CONDITION_SQUARED: f32 = 1e4;
const SMALLEST_NORMAL: f32 = 1.17549435e-38;
const HUGE: f32 = 3e38;
// Two roundings of the same comparison agree outside this share of its limit.
const CLOSE: f32 = 1e-3;
// The same for a normal that is nearly level with the surface: square of its sine.
const CLOSE_TO_LEVEL_SQUARED: f32 = 1e-8;
// Sum of squares of a photosite that is left open.
const UNDECIDED: f32 = -1.0;

// One photosite.
struct Site {
    piece: u32,
    column: u32,
    // Columns from the piece's start.
    offset: f32,
    n: Symmetric,
    // What the gain maps do to the noise.
    scale: f32,
}

fn dot_fused(a: vec3<f32>, b: vec3<f32>) -> f32 {
    return fma(a.z, b.z, fma(a.y, b.y, a.x * b.x));
}

fn times(m: Symmetric, v: vec3<f32>) -> vec3<f32> {
    return vec3(
        dot_fused(vec3(m.xx, m.xy, m.xz), v),
        dot_fused(vec3(m.xy, m.yy, m.yz), v),
        dot_fused(vec3(m.xz, m.yz, m.zz), v),
    );
}

// v^T m v.
fn form(m: Symmetric, v: vec3<f32>) -> f32 {
    return dot_fused(v, times(m, v));
}

fn trace(m: Symmetric) -> f32 {
    return m.xx + m.yy + m.zz;
}

// sum + w l l^T.
fn add_square(sum: Symmetric, l: vec3<f32>, w: f32) -> Symmetric {
    let v = w * l;
    return Symmetric(
        fma(v.x, l.x, sum.xx), fma(v.x, l.y, sum.xy), fma(v.x, l.z, sum.xz),
        fma(v.y, l.y, sum.yy), fma(v.y, l.z, sum.yz),
        fma(v.z, l.z, sum.zz),
    );
}

// By L D L^T.
fn inverse_of(m: Symmetric) -> Inverse {
    let r1 = 1.0 / m.xx;
    let l21 = m.xy * r1;
    let l31 = m.xz * r1;
    let d2 = fma(-l21, m.xy, m.yy);
    let r2 = 1.0 / d2;
    let l32 = fma(-l21, m.xz, m.yz) * r2;
    let d3 = fma(-(l32 * l32), d2, fma(-l31, m.xz, m.zz));
    let r3 = 1.0 / d3;
    let m31 = fma(l21, l32, -l31);
    let inverse = Symmetric(
        fma(m31, m31 * r3, fma(l21, l21 * r2, r1)),
        -fma(m31 * r3, l32, l21 * r2),
        m31 * r3,
        fma(l32, l32 * r3, r2),
        -(l32 * r3),
        r3,
    );
    let condition_squared = trace(m) * trace(inverse);
    return Inverse(inverse, select(HUGE, condition_squared, min(d2, d3) > 0.0));
}

// By its bits: a shader may take for granted that no number is infinite or none.
fn is_finite(value: f32) -> bool {
    return (bitcast<u32>(value) & 0x7f800000u) != 0x7f800000u;
}

fn sample_bits(site: Site, plane: u32) -> u32 {
    let piece = pieces[site.piece];
    return samples[piece.before * settings.planes + plane * piece.width + site.column];
}

fn y_of(site: Site, light: u32) -> f32 {
    return bitcast<f32>(sample_bits(site, light));
}

fn first_coefficient(piece: u32) -> u32 {
    return piece * (COEFFICIENTS_OF_INVERSE + settings.lights * COEFFICIENTS_OF_LIGHT);
}

fn entry_of_inverse(piece: u32, entry: u32, offset: f32) -> f32 {
    let at = first_coefficient(piece) + entry;
    return fma(coefficients[at + 6u], offset, coefficients[at]);
}

fn light_of(site: Site, light: u32) -> vec3<f32> {
    let at = first_coefficient(site.piece) + COEFFICIENTS_OF_INVERSE + light * COEFFICIENTS_OF_LIGHT;
    let start = vec3(coefficients[at], coefficients[at + 1u], coefficients[at + 2u]);
    let growth = vec3(coefficients[at + 3u], coefficients[at + 4u], coefficients[at + 5u]);
    return fma(growth, vec3(site.offset), start);
}

fn site_at(piece: u32, column: u32) -> Site {
    let offset = f32(column - pieces[piece].start);
    let n = Symmetric(
        entry_of_inverse(piece, 0u, offset),
        entry_of_inverse(piece, 1u, offset),
        entry_of_inverse(piece, 2u, offset),
        entry_of_inverse(piece, 3u, offset),
        entry_of_inverse(piece, 4u, offset),
        entry_of_inverse(piece, 5u, offset),
    );
    var site = Site(piece, column, offset, n, 1.0);
    if settings.planes > settings.lights {
        site.scale = y_of(site, settings.lights);
    }
    return site;
}

// var(y) of a light's sample at a predicted value.
fn variance(site: Site, light: u32, predicted: f32) -> f32 {
    let place = pieces[site.piece].row_parity * 2u + (site.column & 1u);
    let model = noise[light * 4u + place];
    let lit = max(predicted, 0.0);
    let model_error = model.z * lit;
    let floor = model.y * site.scale * site.scale;
    return fma(model_error, model_error, fma(model.x * site.scale, lit, floor));
}

struct Start {
    complete: bool,
    // N L^T y, unrefined.
    g: vec3<f32>,
    // The largest sample.
    level: f32,
}

fn start_of(site: Site) -> Start {
    var start = Start(true, vec3(0.0), 0.0);
    for (var i = 0u; i < settings.lights; i++) {
        if (sample_bits(site, i) & 0x7f800000u) == 0x7f800000u {
            start.complete = false;
            return start;
        }
        let y = y_of(site, i);
        start.level = max(start.level, abs(y));
        start.g = fma(light_of(site, i), vec3(y), start.g);
    }
    start.g = times(site.n, start.g);
    return start;
}

fn store(site: Site, g: vec3<f32>, tangent_variance: f32, squares: f32) {
    let piece = pieces[site.piece];
    let at = piece.before * FOUND_PLANES + site.column;
    found[at] = g.x;
    found[at + piece.width] = g.y;
    found[at + 2u * piece.width] = g.z;
    found[at + 3u * piece.width] = tangent_variance;
    found[at + 4u * piece.width] = squares;
}

// A photosite that asks for a slower way.
fn refuse(site: Site) {
    store(site, vec3(0.0), 0.0, 0.0);
}

fn leave_open(site: Site) {
    store(site, vec3(0.0), 0.0, UNDECIDED);
}

fn store_or_leave_open(site: Site, g: vec3<f32>, tangent_variance: f32, squares: f32) {
    let level_with_surface = g.z * g.z <= CLOSE_TO_LEVEL_SQUARED * dot_fused(g, g);
    if level_with_surface || !is_finite(g.x + g.y + g.z + tangent_variance + squares) {
        leave_open(site);
    } else {
        store(site, g, tangent_variance, max(squares, 0.0));
    }
}

// g = N L^T y refined once on its residual; covariance N (sum var l l^T) N across the normal.
fn least_squares(site: Site) {
    let start = start_of(site);
    if !start.complete || start.level == 0.0 {
        refuse(site);
        return;
    }
    var right = vec3(0.0);
    var spread = Symmetric();
    var squares = 0.0;
    for (var i = 0u; i < settings.lights; i++) {
        let l = light_of(site, i);
        let predicted = dot_fused(l, start.g);
        let residual = y_of(site, i) - predicted;
        squares = fma(residual, residual, squares);
        right = fma(l, vec3(residual), right);
        spread = add_square(spread, l, variance(site, i, predicted));
    }
    let n = site.n;
    let change = times(n, right);
    // What the change takes off the squares: right . change, as right = L^T L change.
    squares -= dot_fused(right, change);
    let g = start.g + change;
    let whole = form(spread, vec3(n.xx, n.xy, n.xz)) + form(spread, vec3(n.xy, n.yy, n.yz))
        + form(spread, vec3(n.xz, n.yz, n.zz));
    let along = form(spread, times(n, g)) / dot_fused(g, g);
    store_or_leave_open(site, g, whole - along, squares);
}

fn weight(site: Site, light: u32, predicted: f32, least: f32) -> f32 {
    return 1.0 / max(variance(site, light, predicted), least);
}

// Every sample weighs 1 / var at the plain start's prediction. Only what noise explains so, with every light in front of
// the surface, is solved.
fn weighted(site: Site) {
    let start = start_of(site);
    if !start.complete || start.level == 0.0 {
        refuse(site);
        return;
    }
    let sigma = RELATIVE_FLOOR * start.level;
    let least = max(sigma * sigma, SMALLEST_NORMAL);
    var right = vec3(0.0);
    var matrix = Symmetric();
    var lowest = HUGE;
    for (var i = 0u; i < settings.lights; i++) {
        let l = light_of(site, i);
        let predicted = dot_fused(l, start.g);
        lowest = min(lowest, predicted);
        let w = weight(site, i, predicted, least);
        right = fma(l, vec3(w * (y_of(site, i) - predicted)), right);
        matrix = add_square(matrix, l, w);
    }
    let inverse = inverse_of(matrix);
    let n = inverse.matrix;
    let g = start.g + times(n, right);
    var squares = 0.0;
    var chi_square = 0.0;
    for (var i = 0u; i < settings.lights; i++) {
        let l = light_of(site, i);
        let residual = y_of(site, i) - dot_fused(l, g);
        let square = residual * residual;
        squares += square;
        chi_square = fma(weight(site, i, dot_fused(l, start.g), least), square, chi_square);
    }
    let sound = is_finite(chi_square) && is_finite(inverse.condition_squared);
    if !sound || is_close(lowest, 0.0, start.level) || is_close(chi_square, settings.limit, settings.limit)
        || is_close(inverse.condition_squared, WEIGHTED_CONDITION_SQUARED, WEIGHTED_CONDITION_SQUARED) {
        leave_open(site);
    } else if lowest > 0.0 && chi_square <= settings.limit && inverse.condition_squared < WEIGHTED_CONDITION_SQUARED {
        let along = form(n, g) / dot_fused(g, g);
        store_or_leave_open(site, g, trace(n) - along, squares);
    } else {
        refuse(site);
    }
}

fn is_close(value: f32, limit: f32, scale: f32) -> bool {
    return abs(value - limit) <= CLOSE * scale;
}

// Workgroups come in rows of as many as a dimension may have.
fn piece_of(group: vec3<u32>, groups: vec3<u32>) -> u32 {
    return group.y * groups.x + group.x;
}

@compute @workgroup_size(WORKGROUP)
fn least_squares_of_piece(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let piece = piece_of(group, groups);
    if piece >= settings.pieces {
        return;
    }
    for (var column = pieces[piece].start + lane; column < pieces[piece].end; column += WORKGROUP) {
        least_squares(site_at(piece, column));
    }
}

@compute @workgroup_size(WORKGROUP)
fn weighted_of_piece(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let piece = piece_of(group, groups);
    if piece >= settings.pieces {
        return;
    }
    for (var column = pieces[piece].start + lane; column < pieces[piece].end; column += WORKGROUP) {
        weighted(site_at(piece, column));
    }
}
