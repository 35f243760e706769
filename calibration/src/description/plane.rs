use nalgebra::{Point3, UnitVector3, Vector3};

/// The imaged surface: the table, a thick swatch's top, a raised or tilted sheet.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// Any point on it, rig frame, millimetres.
    pub point_mm: Point3<f64>,
    /// Its normal, rig frame, towards the camera.
    pub normal: UnitVector3<f64>,
}

impl Plane {
    /// The table itself: z = 0.
    pub fn table() -> Self {
        Self { point_mm: Point3::origin(), normal: Vector3::z_axis() }
    }
}
