//! What is photographed: a swatch, or a calibration target, and what its capture session says of it.

use crate::instrument::{Rig, RigLightPlace};
use crate::session::{self, Kind, Target};
use nalgebra::{Point3, Vector3};
use weavelight_calibration::description::Plane;

/// What is photographed.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Subject {
    /// A fabric to solve.
    #[default]
    Swatch,
    /// A white sheet.
    White(Sheet),
    /// A grey or colour chart on the table: every light at one exposure, and one light at several.
    Grey {
        /// Its patches in the picture.
        patches: Vec<session::Patch>,
    },
    /// A chessboard: one picture, added to those that are there.
    Board {
        /// Inner corners and squares.
        board: session::Board,
        /// How it lies.
        pose: Pose,
        /// The light that is on.
        light: usize,
    },
}

/// A white sheet as the technician knows it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sheet {
    /// How much it reflects; 0.99 where absent.
    pub reflectance: Option<f64>,
    /// Where it is, if that is known and not level.
    pub plane: Option<Plane>,
    /// A chessboard printed beside the measured area, whose pictures tell where the sheet is.
    pub strip: Option<session::Board>,
}

/// How a chessboard lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pose {
    /// Flat on the table and centred: this picture fixes the rig frame. There is one; another replaces it.
    Table,
    /// Anyhow.
    Free,
}

impl Subject {
    /// As the capture session says it.
    pub fn kind(&self) -> Kind {
        match self {
            Self::Swatch => Kind::Swatch,
            Self::White(_) => Kind::White,
            Self::Grey { .. } => Kind::Grey,
            Self::Board { .. } => Kind::Board,
        }
    }

    /// `[target]` of the capture session.
    pub fn target(&self) -> Option<Target> {
        match self {
            Self::Swatch => None,
            Self::White(sheet) => Some(Target {
                reflectance: sheet.reflectance,
                board: sheet.strip,
                patches: Vec::new(),
            }),
            Self::Grey { patches } => {
                Some(Target { patches: patches.clone(), ..Target::default() })
            }
            Self::Board { board, .. } => Some(Target { board: Some(*board), ..Target::default() }),
        }
    }

    /// `[plane]` of the capture session: what is known of the surface, else level and `thickness_mm` over the table.
    pub(super) fn plane(&self, thickness_mm: Option<f64>) -> Option<Plane> {
        let stated = match self {
            Self::White(sheet) => sheet.plane.clone(),
            _ => None,
        };
        stated.or(thickness_mm.map(level))
    }

    /// Whether nobody knows yet how the surface lies to the lights: only its strip will tell.
    pub(super) fn lies_unknown(&self, thickness_mm: Option<f64>) -> bool {
        let strip = matches!(self, Self::White(Sheet { strip: Some(_), .. }));
        strip && self.plane(thickness_mm).is_none()
    }

    /// The light to find the exposure under: of targets, whose reflectance is even, the one that by the rig's ruler shines
    /// strongest on them, so that no other clips.
    pub(super) fn metered_light(&self, rig: &Rig, thickness_mm: Option<f64>) -> usize {
        if let Self::Board { light, .. } = self {
            return *light;
        }
        if *self == Self::Swatch {
            return 0;
        }
        let plane = self.plane(thickness_mm).unwrap_or_else(Plane::table);
        let lights = rig.lights.iter().map(|light| arrival(&light.place, &plane)).enumerate();
        lights.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(light, _)| light)
    }
}

/// What of a light arrives at the plane's point, relative: cosine of incidence over distance squared.
fn arrival(place: &RigLightPlace, plane: &Plane) -> f64 {
    match place {
        RigLightPlace::Point { position_mm, .. } => {
            let to_light_mm = position_mm - plane.point_mm;
            plane.normal.dot(&to_light_mm) / to_light_mm.norm().powi(3)
        }
        RigLightPlace::Directional { direction } => plane.normal.dot(direction),
    }
}

fn level(height_mm: f64) -> Plane {
    Plane { point_mm: Point3::new(0.0, 0.0, height_mm), normal: Vector3::z_axis() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::scan::plan::tests::reference_rig;
    use nalgebra::UnitVector3;

    #[test]
    fn sheets_are_metered_under_the_light_that_they_face() {
        let rig = reference_rig();
        for (light, placed) in rig.lights.iter().enumerate() {
            let RigLightPlace::Point { position_mm, .. } = placed.place else { panic!("near") };
            let normal = UnitVector3::new_normalize(position_mm.coords);
            let plane = Some(Plane { point_mm: Point3::origin(), normal });
            let sheet = Subject::White(Sheet { plane, ..Sheet::default() });
            let metered = sheet.metered_light(&rig, None);
            let towards = |k: usize| match rig.lights[k].place {
                RigLightPlace::Point { position_mm, .. } => {
                    normal.dot(&position_mm.coords) / position_mm.coords.norm().powi(3)
                }
                RigLightPlace::Directional { .. } => 0.0,
            };
            assert!(towards(metered) >= towards(light), "{light}: {metered}");
        }
        assert_eq!(Subject::Swatch.metered_light(&rig, Some(2.0)), 0);
    }

    #[test]
    fn a_sheet_whose_strip_alone_tells_where_it_is() {
        let strip = Some(session::Board { columns: 17, rows: 3, square_mm: 9.0 });
        let sheet = |plane| Subject::White(Sheet { strip, plane, ..Sheet::default() });
        assert!(sheet(None).lies_unknown(None));
        assert!(!sheet(None).lies_unknown(Some(0.0)));
        assert!(!sheet(Some(Plane::table())).lies_unknown(None));
        assert_eq!(sheet(None).plane(Some(100.0)).unwrap().point_mm.z, 100.0);
    }
}
