//! Joint friction against closed forms and against sums of many sliders.

use std::f64::consts::{PI, TAU};

use num_complex::Complex64;

use super::*;
use crate::path::{SampledMotion, restoring_along};
use crate::{MotionState, RestoringForce};

const SOFTENING: f64 = 2e5;
const REFERENCE_M: f64 = 1e-5;

fn joint(more: &[&str]) -> Box<dyn RestoringForce> {
    let structure = crate::case::tests::case("kuka-kr90-y17-low").structure.unwrap();
    let first = ["joint-friction=2e5", "joint-friction.reference_m=1e-5"];
    let texts = first.into_iter().chain(more.iter().copied());
    let effects = Effects::parse(texts).unwrap();
    effects.0[0].restoring_forces(&structure).unwrap().remove(0)
}

/// Sliders of the density R·φ^χ below `most_m`, each with the whole stiffness of an interval of φ and its mean strength,
/// and one of the strength `most_m` with the share β.
struct Sliders {
    /// Stiffness, N/m, strength, m, and position, m.
    each: Vec<[f64; 3]>,
}

impl Sliders {
    fn new(e: f64, most_m: f64, beta: f64) -> Self {
        let count = 4000;
        let density = SOFTENING * e * (e + 1.0) / REFERENCE_M.powf(e);
        // Intervals whose limits grow with the square of their number are finer at small strengths.
        let limit = |k: usize| most_m * (k as f64 / f64::from(count)).powi(2);
        let mut each: Vec<[f64; 3]> = (0..count as usize)
            .map(|k| {
                let (a, b) = (limit(k), limit(k + 1));
                let stiffness = density * (b.powf(e) - a.powf(e)) / e;
                let moment = density * (b.powf(e + 1.0) - a.powf(e + 1.0)) / (e + 1.0);
                [stiffness, moment / stiffness, 0.0]
            })
            .collect();
        each.push([beta * density * most_m.powf(e) / e, most_m, 0.0]);
        Self { each }
    }

    /// F_J(x) − K_T·x at the next point of a path: minus the sum of stiffness times slip.
    fn at(&mut self, x: f64) -> f64 {
        self.each
            .iter_mut()
            .map(|[stiffness, strength, place]| {
                *place = place.clamp(x - *strength, x + *strength);
                -*stiffness * *place
            })
            .sum()
    }
}

/// Force of the joint along a path of displacements, in order.
fn along(joint: &dyn RestoringForce, path: &[f64]) -> Vec<f64> {
    let motion = SampledMotion {
        step_s: 1.0,
        x: [Vec::new(), path.to_vec(), Vec::new()],
        ..SampledMotion::default()
    };
    let [_, force, _] = restoring_along(joint, &motion);
    force
}

/// Straight lines from 0 through these turning points, with `count` points on each.
fn through(turning_m: &[f64], count: usize) -> Vec<f64> {
    let mut path = vec![0.0];
    for to in turning_m {
        let from = path[path.len() - 1];
        path.extend((1..=count).map(|k| from + (to - from) * k as f64 / count as f64));
    }
    path
}

#[test]
fn first_loading_is_the_backbone_and_a_loop_has_the_area_of_its_closed_form() {
    for e in [0.25, 0.6, 1.0] {
        let joint = joint(&[&format!("joint-friction.exponent={e}")]);
        let mut losses = Vec::new();
        for amplitude in [1e-5, 4e-5] {
            let count = 4000;
            let path = through(&[amplitude, -amplitude, amplitude], count);
            let force = along(&*joint, &path);
            for (x, force) in path.iter().zip(&force).take(count) {
                let wanted = -SOFTENING * x * (x / REFERENCE_M).powf(e);
                assert!((force - wanted).abs() <= 1e-12 * wanted.abs());
            }
            let loss: f64 = (count + 1..path.len())
                .map(|k| 0.5 * (force[k] + force[k - 1]) * (path[k] - path[k - 1]))
                .sum();
            let size = SOFTENING * amplitude.powi(2) * (amplitude / REFERENCE_M).powf(e);
            let wanted = 4.0 * e / (e + 2.0) * size;
            assert!((loss / wanted - 1.0).abs() < 1e-5, "{e}: {loss} {wanted}");
            losses.push(loss);
        }
        let power = (losses[1] / losses[0]).ln() / 4.0_f64.ln();
        assert!((power - (e + 2.0)).abs() < 1e-5, "{power}");
    }
}

/// A path with nested loops, closed ones, and a return to first loading.
const TURNING_M: [f64; 12] = [
    2e-5, -1e-5, 1.5e-5, -0.5e-5, 0.7e-5, -0.8e-5, 3e-5, -2.8e-5, 2e-5, 4e-5, -4.5e-5, 1e-5,
];

#[test]
fn any_path_has_the_force_of_a_sum_of_sliders() {
    for (e, slip_m, beta) in [
        (0.3, None, 0.0),
        (1.0, None, 0.0),
        (0.5, Some(1.5e-5), 0.0),
        (0.7, Some(1.2e-5), 0.8),
    ] {
        let mut texts = vec![format!("joint-friction.exponent={e}")];
        if let Some(slip_m) = slip_m {
            texts.push(format!("joint-friction.slip_m={slip_m:e}"));
            texts.push(format!("joint-friction.beta={beta}"));
        }
        let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
        // Without complete slip the sliders that never slip on this path do not matter.
        let mut sliders = Sliders::new(e, slip_m.unwrap_or(6e-5), beta);
        let path = through(&TURNING_M, 400);
        let force = along(&*joint(&texts), &path);
        let wanted: Vec<f64> = path.iter().map(|x| sliders.at(*x)).collect();
        let size = wanted.iter().fold(0.0_f64, |most, force| most.max(force.abs()));
        for (k, (force, wanted)) in force.iter().zip(&wanted).enumerate() {
            assert!((force - wanted).abs() < 1e-5 * size, "{e} {k}: {force} {wanted}");
        }
    }
}

#[test]
fn the_describing_function_is_the_sum_of_many_sliders() {
    for (e, slip_m, beta) in [
        (0.3, None, 0.0),
        (1.0, None, 0.0),
        (0.5, Some(1.5e-5), 0.0),
        (0.7, Some(1.2e-5), 0.8),
    ] {
        let mut texts = vec![format!("joint-friction.exponent={e}")];
        if let Some(slip_m) = slip_m {
            texts.push(format!("joint-friction.slip_m={slip_m:e}"));
            texts.push(format!("joint-friction.beta={beta}"));
        }
        let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
        let joint = joint(&texts);
        for amplitude in [1e-5, 2e-5, 5e-5] {
            let closed = joint.describing_function(amplitude, 110.0).unwrap();
            let mut sliders = Sliders::new(e, slip_m.unwrap_or(6e-5), beta);
            let count = 4000;
            let mut sum = Complex64::ZERO;
            for k in 0..2 * count {
                let angle = TAU * f64::from(k) / f64::from(count);
                let force = sliders.at(amplitude * angle.sin());
                if k >= count {
                    sum += force * Complex64::new(angle.sin(), angle.cos());
                }
            }
            let summed = sum * (2.0 / (f64::from(count) * amplitude));
            assert!(
                (summed - closed).norm() < 1e-4 * closed.norm(),
                "{e} {amplitude}: {summed} {closed}"
            );
            if slip_m.is_none() {
                let secant = SOFTENING * (amplitude / REFERENCE_M).powf(e);
                let loss = 4.0 * e / (PI * (e + 2.0)) * secant;
                assert!((closed.im / loss - 1.0).abs() < 1e-6, "{e}: {closed} {loss}");
                // Γ(e + 3/2)/Γ(e + 2) = 2/√π·∫ sin^(2e + 2) from 0 to π/2.
                let steps = 20_000;
                let integral: f64 = (0..steps)
                    .map(|k| {
                        (0.5 * PI * (f64::from(k) + 0.5) / f64::from(steps))
                            .sin()
                            .powf(2.0 * e + 2.0)
                    })
                    .sum::<f64>()
                    * (0.5 * PI / f64::from(steps));
                let first = 8.0 * (e + 1.0) / (PI * (e + 2.0)) * integral;
                assert!(
                    (closed.re / (-first * secant) - 1.0).abs() < 1e-6,
                    "{e}: {closed}"
                );
            }
        }
    }
}

#[test]
fn a_long_decay_and_a_new_motion_need_no_more_memory() {
    // A decay of 300 turning points to 0.5 %, then growth to beyond its start: 16 points are in memory.
    let e = 0.5;
    let joint = joint(&["joint-friction.exponent=0.5"]);
    let decay = (0..300).map(|k| 3e-5 * (-1.0_f64).powi(k) * 0.9825_f64.powi(k));
    let growth = (0..60).map(|k| -2e-7 * (-1.0_f64).powi(k) * 1.1_f64.powi(k));
    let turning: Vec<f64> = decay.chain(growth).collect();
    let path = through(&turning, 40);
    let force = along(&*joint, &path);
    let mut sliders = Sliders::new(e, 7e-5, 0.0);
    let wanted: Vec<f64> = path.iter().map(|x| sliders.at(*x)).collect();
    let apart = |from: usize, to: usize| {
        let apart = (from..to).map(|k| (force[k] - wanted[k]).abs());
        let size = (from..to).map(|k| wanted[k].abs()).fold(0.0, f64::max);
        apart.fold(0.0, f64::max) / size
    };
    let (decays, grows) = (apart(0, 300 * 40), apart(300 * 40, path.len()));
    println!("decay {decays:e}, growth {grows:e}");
    // The sliders of the sum have an error of their own where the motion is as small as the finest of them.
    assert!(decays < 1e-5, "{decays}");
    assert!(grows < 1e-4, "{grows}");
}

#[test]
fn a_loop_begins_where_a_structure_is_let_go() {
    let joint = joint(&["joint-friction.exponent=0.5"]);
    let at = |x: f64, v: f64| MotionState {
        t: 0.0,
        x: [0.0, x, 0.0],
        v: [0.0, v, 0.0],
    };
    let mut own = vec![0.0; joint.states()];
    joint.begin(&at(2e-5, 0.0), &mut own);
    let [_, let_go, _] = joint.restoring_n(1, &at(2e-5, 0.0), &own);
    let [_, opposite, _] = joint.restoring_n(1, &at(-2e-5, 0.0), &own);
    let wanted = -SOFTENING * 2e-5 * 2.0_f64.sqrt();
    assert!(
        (let_go - wanted).abs() < 1e-12 && (opposite + wanted).abs() < 1e-12,
        "{let_go} {opposite}"
    );
    joint.begin(&at(2e-5, 0.1), &mut own);
    let [_, loading, _] = joint.restoring_n(0, &at(3e-5, 0.1), &own);
    assert!((loading + SOFTENING * 3e-5 * 3.0_f64.sqrt()).abs() < 1e-12);
}

#[test]
fn slip_needs_its_displacement() {
    let texts = [
        "joint-friction=1",
        "joint-friction.exponent=0.5",
        "joint-friction.reference_m=1e-5",
        "joint-friction.beta=1",
    ];
    let error = Effects::parse(texts).unwrap_err();
    assert_eq!(error.location(), Some(("joint-friction", "beta")));
}
