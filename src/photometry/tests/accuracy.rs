//! The statistical limit: Lambertian facets with the reference sensor's noise.

use nalgebra::Matrix3;

use super::scene::{Random, Scene, Solved, angle_deg, reference_lights, tilted};
use crate::photometry::{Method, Outcome};

struct Figures {
    rms_over_limit: f64,
    albedo_bias: f64,
    expected_over_rms: f64,
    fitted: f64,
}

/// Cramer-Rao limit of one photosite of a scene, squared radians across the normal; the lights behind the surface say
/// nothing.
fn limit_squared(scene: &Scene, column: usize) -> f64 {
    let mut information = Matrix3::zeros();
    for light in 0..scene.lights {
        let l = scene.field().at(column, light);
        let y = scene.clean(light, column);
        let model = scene.variance[light][column & 1];
        let variance = f64::from(model.shot) * y
            + f64::from(model.floor)
            + (f64::from(model.kappa) * y).powi(2);
        if y > 0.0 {
            information += l * l.transpose() / variance;
        }
    }
    let covariance = information.try_inverse().unwrap();
    let n = scene.normal[column];
    (covariance.trace() - n.dot(&(covariance * n))) / scene.albedo[column].powi(2)
}

fn figures(scene: &Scene, solved: &Solved) -> Figures {
    let (mut squares, mut limit, mut albedo, mut expected, mut fitted) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for column in 0..scene.width {
        if solved.outcome[column] == Outcome::Fitted {
            fitted += 1.0;
        }
        squares += angle_deg(&solved.normal(column), &scene.normal[column]).to_radians().powi(2);
        limit += limit_squared(scene, column);
        albedo += f64::from(solved.albedo[column]) / scene.albedo[column];
        expected += f64::from(solved.expected_error_deg[column]).to_radians().powi(2);
    }
    let width = scene.width as f64;
    Figures {
        rms_over_limit: (squares / limit).sqrt(),
        albedo_bias: albedo / width - 1.0,
        expected_over_rms: (expected / squares).sqrt(),
        fitted: fitted / width,
    }
}

#[test]
fn lambertian_facets_reach_the_limit() {
    let mut random = Random::new(7);
    for albedo in [0.02, 0.1, 0.5, 0.9] {
        for tilt_deg in [0.0, 15.0, 30.0, 45.0, 60.0, 70.0, 75.0] {
            let facet = |_| (tilted(&mut random, tilt_deg), albedo);
            let mut scene = Scene::new(&reference_lights(), 20_000, 64, facet);
            scene.add_noise(&mut random);
            for method in [Method::LeastSquares, Method::Weighted] {
                let f = figures(&scene, &scene.fast(method));
                println!(
                    "{albedo:4} {tilt_deg:2} {method:12?}: {:.3} x limit, bias {:+.3} %, expected {:.3}, fitted {:.4}",
                    f.rms_over_limit,
                    100.0 * f.albedo_bias,
                    f.expected_over_rms,
                    f.fitted
                );
            }
        }
    }
}
