use super::AlbedoReport;
use weavelight_calibration::description::Image;

/// The maps of a solution; zero where unsolved.
pub struct Finished {
    /// Unit normals, rig frame.
    pub normal: Image<[f32; 3]>,
    /// Linear RGB; without a pixel where nobody asked for it.
    pub albedo: Image<[f32; 3]>,
    /// What was divided out of the albedo; without a pixel where it was not asked for.
    pub shade: Image<f32>,
    /// Expected error of the normal, degrees.
    pub confidence: Image<f32>,
    /// 255 where solved.
    pub mask: Image<u8>,
    /// What the albedo is.
    pub albedo_report: AlbedoReport,
    /// What there is to say of it, in sentences.
    pub said: Vec<String>,
}
