//! Plain data: what a camera, a light, a plane, a rig and a picture are. No behaviour beyond construction and access.
//!
//! **Rig frame**: right-handed, origin at the centre of the scan area on the table, +x right in the picture, +y to the
//! top of the picture, +z up to the camera; millimetres. **Camera frame**: x right, y down, z forward. **Pixels**: u
//! right, v down, the centre of the top-left pixel is (0, 0).

mod camera;
mod image;
mod light;
mod plane;
mod sensor;

pub use camera::Camera;
pub use image::Image;
pub use light::{DirectionalLight, Light, PointLight};
pub use plane::Plane;
pub use sensor::{Cfa, Channel};
