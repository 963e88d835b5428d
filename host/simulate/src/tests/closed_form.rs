//! Motions that have a closed form.

use std::f64::consts::TAU;

use super::*;

/// The benchmark's oscillator: mass, natural angular frequency, damping ratio.
const MASS_KG: f64 = 0.03993;
const OMEGA: f64 = TAU * 922.0;
const ZETA: f64 = 0.011;

fn oscillator(drive: Option<Box<dyn Drive>>) -> Model {
    Model {
        dynamics: Dynamics::new(case("insperger-1dof-ad1").structure().unwrap()).unwrap(),
        cutting: None,
        drive,
        restoring_forces: Vec::new(),
    }
}

/// The largest error of the free decay from 0.1 mm over a tenth of a second, m.
fn free_decay_error_m(relative: f64) -> f64 {
    let model = oscillator(None);
    let damped = OMEGA * (1.0 - ZETA * ZETA).sqrt();
    let every_s = 1.3e-4;
    motions_from(&model, vec![1e-4, 0.0], exact(relative), 0.0, every_s, 0.1)
        .iter()
        .enumerate()
        .map(|(k, motion)| {
            let t = k as f64 * every_s;
            let (sin, cos) = (damped * t).sin_cos();
            let expected = 1e-4 * (-ZETA * OMEGA * t).exp() * (cos + ZETA * OMEGA / damped * sin);
            (motion.displacement_m[0] - expected).abs()
        })
        .fold(0.0, f64::max)
}

#[test]
fn a_free_decay_is_exponential_and_its_error_follows_the_tolerance() {
    let errors = [1e-6, 1e-8, 1e-10].map(free_decay_error_m);
    // The error follows the tolerance with the power 5/6 for a local error of order 6: a tolerance of a hundredth divides it by 46.
    // A factor of 20 leaves room for the choice of steps.
    assert!(
        errors[0] / errors[1] > 20.0 && errors[1] / errors[2] > 20.0,
        "{errors:?}"
    );
    // Over 92 oscillations the local errors add up to a few hundred times the tolerance.
    assert!(errors[1] < 3e-6 * 1e-4, "{errors:?}");
}

struct Cosine {
    omega: f64,
}

impl Drive for Cosine {
    fn force_n(&self, t: f64) -> [f64; 3] {
        [2.0 * (self.omega * t).cos(), 0.0, 0.0]
    }
}

#[test]
fn a_harmonic_force_gives_the_receptance() {
    for ratio in [0.3, 0.95, 1.0, 1.7] {
        let omega = ratio * OMEGA;
        let model = oscillator(Some(Box::new(Cosine { omega })));
        // e^(−ζω t) is 1e-14 after half a second.
        let every_s = 1e-4;
        let motions = motions(&model, exact(1e-10), 0.5, every_s, 0.55);
        let dynamic = num_complex::Complex64::new(
            MASS_KG * (OMEGA * OMEGA - omega * omega),
            MASS_KG * 2.0 * ZETA * OMEGA * omega,
        );
        let receptance = dynamic.inv();
        for (k, motion) in motions.iter().enumerate() {
            let t = 0.5 + k as f64 * every_s;
            let rotating = num_complex::Complex64::from_polar(2.0, omega * t);
            let i_omega = num_complex::Complex64::new(0.0, omega);
            let expected = [
                (receptance * rotating).re,
                (receptance * rotating * i_omega).re,
                (receptance * rotating * i_omega * i_omega).re,
            ];
            let found = [
                motion.displacement_m[0],
                motion.velocity_m_per_s[0],
                motion.acceleration_m_per_s2.unwrap()[0],
            ];
            for (power, (found, expected)) in found.iter().zip(expected).enumerate() {
                let size = 2.0 * receptance.norm() * omega.powi(power as i32);
                // Local errors of 1e-10 add up over the thousand steps of the decay time. They oscillate at the natural frequency, so
                // that they are larger relative to the acceleration of a slow excitation.
                assert!(
                    (found - expected).abs() < 1e-6 * size,
                    "{ratio}: {found} {expected}"
                );
            }
        }
    }
}

#[test]
fn the_force_on_a_rigid_machine_is_that_of_chapter_3() {
    // The structure is so heavy that it does not vibrate: the force is that of the feed alone.
    let mut case = case("staubli-tx200");
    if let quietcut_model::structure::Form::Matrices(matrices) = &mut case.structure.as_mut().unwrap().form {
        matrices.mass *= 1e9;
        matrices.stiffness *= 1e9;
        matrices.damping *= 1e9;
    }
    let (rpm, depth_mm) = (500.0, 0.67);
    let model = steady(&case, rpm, depth_mm);
    // One of four teeth cuts at a time, from 126.87° to 180°; thesis eq. 3.6 with φ in the middle of the cut.
    let phi: f64 = 150.0_f64.to_radians();
    let t = phi / TAU * 60.0 / rpm;
    let motion = motions(&model, Settings::default(), t, 1.0, 1.5 * t)[0];
    let gamma = 50.0_f64.to_radians();
    let chip_mm = 0.05 * phi.sin() * gamma.sin();
    let width_mm = depth_mm / gamma.sin();
    let ft = 25.0 * width_mm + 1835.0 * chip_mm * depth_mm;
    let fr = 45.0 * width_mm + 1132.0 * chip_mm * depth_mm;
    let fa = 10.0 * width_mm + 280.0 * chip_mm * depth_mm;
    let expected = [
        -ft * phi.cos() - (fr * gamma.sin() + fa * gamma.cos()) * phi.sin(),
        ft * phi.sin() - (fr * gamma.sin() + fa * gamma.cos()) * phi.cos(),
        fr * gamma.cos() - fa * gamma.sin(),
    ];
    for (found, expected) in motion.force_n.iter().zip(expected) {
        // The heavy structure still moves by about a picometre.
        assert!(
            (found - expected).abs() < 1e-5,
            "{:?} {expected:?}",
            motion.force_n
        );
    }
}

#[test]
fn runout_changes_the_chip_thickness_of_each_tooth() {
    use quietcut_model::milling::Runout;
    let mut case = case("kuka-kr90-full");
    if let quietcut_model::structure::Form::Matrices(matrices) = &mut case.structure.as_mut().unwrap().form {
        matrices.mass *= 1e9;
        matrices.stiffness *= 1e9;
        matrices.damping *= 1e9;
    }
    let mut model = steady(&case, 600.0, 1.0);
    let (offset_um, angle_deg): (f64, f64) = (20.0, 30.0);
    model
        .cutting
        .as_mut()
        .unwrap()
        .cutter
        .set_runout(Runout { offset_um, angle_deg });
    // Tooth 1 is at 90° after a quarter revolution, tooth 2 half a revolution later. In the second revolution the surface in front is cut.
    let force = motions(&model, Settings::default(), 0.125, 0.05, 0.2);
    let radial_mm = |tooth: f64| 1e-3 * offset_um * (angle_deg.to_radians() + 0.5 * TAU * tooth).cos();
    for (motion, (tooth, other)) in force.iter().zip([(0.0, 1.0), (1.0, 0.0)]) {
        let chip_mm = 0.15 + radial_mm(tooth) - radial_mm(other);
        // At φ = 90° the tangential force is along y.
        let expected = 76.0 * chip_mm;
        assert!(
            (motion.force_n[1] - expected).abs() < 1e-6,
            "{motion:?} {expected}"
        );
    }
}

/// Displacements, m, where the velocity changes sign, in a free motion of the undamped oscillator under f_r = `c2`·|v|·v from `start_m`.
fn reversals_m(c2: f64, start_m: f64, relative: f64) -> Vec<f64> {
    let mut structure = case("insperger-1dof-ad1").structure.unwrap();
    if let quietcut_model::structure::Form::Matrices(matrices) = &mut structure.form {
        matrices.damping.fill(0.0);
    }
    let effects = Effects::parse([format!("quadratic-damping={c2}").as_str()]).unwrap();
    let (dynamics, restoring_forces) = effects.dynamics(&structure).unwrap();
    let model = Model {
        dynamics,
        cutting: None,
        drive: None,
        restoring_forces,
    };
    let mut workspace = Workspace::new(&model);
    let (mut found, mut sign) = (Vec::new(), 0.0);
    model
        .run_from(vec![start_m, 0.0], 0.02, exact(relative), |segment| {
            let mut at = |t: f64| {
                let motion = segment.motion(t, &mut workspace);
                (motion.displacement_m[0], motion.velocity_m_per_s[0])
            };
            // Away from the ends by a millionth of the step: the velocity there is zero to rounding where an event ends a step.
            let inset = 1e-6 * (segment.to_s() - segment.from_s());
            let (mut before, mut after) = (segment.from_s() + inset, segment.to_s() - inset);
            let (first, last) = (at(before).1, at(after).1);
            if sign * first < 0.0 {
                found.push(at(segment.from_s()).0);
            }
            if first * last < 0.0 {
                for _ in 0..60 {
                    let middle = 0.5 * (before + after);
                    if first * at(middle).1 > 0.0 {
                        before = middle;
                    } else {
                        after = middle;
                    }
                }
                found.push(at(before).0);
            }
            sign = last;
        })
        .unwrap();
    found
}

#[test]
fn reversals_under_quadratic_damping_follow_their_first_integral() {
    // Between reversals v² = (ω²/a)·(x + 1/2a) + K·exp(2a·x) for v < 0, with a = c2/m: each magnitude follows from the one before,
    // (1 − 2a·X')·exp(2a·X') = (1 + 2a·X)·exp(−2a·X).
    let (c2, start_m) = (60.0, 1e-4);
    let a2 = 2.0 * c2 / MASS_KG;
    for relative in [1e-8, 1e-10, 1e-12] {
        let found = reversals_m(c2, start_m, relative);
        assert!(found.len() > 30, "{found:?}");
        let (mut magnitude, mut worst) = (a2 * start_m, 0.0_f64);
        for found_m in found {
            let target = (1.0 + magnitude) * (-magnitude).exp();
            let next = |x: f64| (1.0 - x) * x.exp() - target;
            let (mut low, mut high) = (0.0, magnitude);
            for _ in 0..80 {
                let middle = 0.5 * (low + high);
                if next(middle) > 0.0 {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            magnitude = low;
            worst = worst.max((found_m.abs() * a2 / magnitude - 1.0).abs());
        }
        // The largest of 36 reversals: three local errors each.
        assert!(worst < 200.0 * relative, "{relative:e}: {worst:e}");
    }
}
