//! Compares the integrator with motions in closed form.

use nalgebra::DMatrix;

use super::law::Law;
use super::motion::{Path, System};
use super::sliders::Sliders;

const MASS: f64 = 2.0;
const STIFFNESS: f64 = 800.0;
const OMEGA: f64 = 20.0;

fn one(damping: f64, laws: &[Law], step_s: f64) -> System {
    let matrix = |value| DMatrix::from_element(1, 1, value);
    let mut system = System::new(
        &matrix(MASS),
        &matrix(damping),
        &matrix(STIFFNESS),
        &[[1.0, 0.0, 0.0]],
        step_s,
    );
    laws.iter().for_each(|law| system.add(*law));
    system
}

/// Free decay from the displacement `start_m` at rest: `count` displacements at intervals `step`.
fn released(system: &System, start_m: f64, step: f64, count: usize) -> Vec<f64> {
    let force = |_: f64, _: [f64; 3], _: [f64; 3]| [0.0; 3];
    let mut y = system.pulled([STIFFNESS * start_m, 0.0, 0.0]);
    let mut branches = system.branches(0.0, &mut y, &force);
    let mut path = Path::default();
    for k in 0..count {
        system.note(k as f64 * step, &y, &branches, &force, &mut path);
        system.advance(k as f64 * step, step, &mut y, &mut branches, &force);
    }
    path.u.iter().map(|u| u[0]).collect()
}

#[test]
fn a_damped_mass_decays_as_in_closed_form() {
    let damping = 4.0;
    let (decay, step) = (damping / (2.0 * MASS), 0.005);
    let omega = (OMEGA * OMEGA - decay * decay).sqrt();
    for (k, u) in released(&one(damping, &[], step), 1e-3, step, 2000)
        .iter()
        .enumerate()
    {
        let t = k as f64 * step;
        let exact = 1e-3 * (-decay * t).exp() * ((omega * t).cos() + decay / omega * (omega * t).sin());
        assert!((u - exact).abs() < 1e-15, "{t}: {u} {exact}");
    }
}

#[test]
fn dry_friction_reduces_the_amplitude_linearly_and_then_sticks() {
    // The amplitude falls by 2·fc/k in each half period until |u| is within fc/k, where the mass sticks.
    let fc = 0.1 * STIFFNESS * 1e-3;
    let friction = Law::Friction {
        axis: 0,
        kinetic_n: fc,
        breakaway_n: fc,
        stribeck_m_per_s: 1.0,
    };
    let step = std::f64::consts::PI / OMEGA / 64.0;
    let u = released(&one(0.0, &[friction], step), 1e-3, step, 64 * 12);
    for (swing, exact) in [1e-3, -0.8e-3, 0.6e-3, -0.4e-3, 0.2e-3, 0.0, 0.0, 0.0]
        .iter()
        .enumerate()
    {
        let found = u[64 * swing];
        assert!((found - exact).abs() < 1e-9, "{swing}: {found} {exact}");
    }
}

#[test]
fn backlash_lengthens_the_period_by_the_time_in_the_gap() {
    // The whole spring has backlash: within the gap the mass moves with the constant speed that the spring gave it.
    let half_gap = 0.3e-3;
    let gap = Law::Gap {
        axis: 0,
        half_gap_m: half_gap,
        stiffness: STIFFNESS,
    };
    let step = 1e-3;
    let u = released(&one(0.0, &[gap], step), 1e-3, step, 4000);
    let speed = OMEGA * (1e-3 - half_gap);
    let period = std::f64::consts::TAU / OMEGA + 4.0 * half_gap / speed;
    let crossings: Vec<f64> = (1..u.len())
        .filter(|k| u[k - 1] < 0.0 && u[*k] >= 0.0)
        .map(|k| (k as f64 - u[k] / (u[k] - u[k - 1])) * step)
        .collect();
    let found = (crossings[crossings.len() - 1] - crossings[0]) / (crossings.len() - 1) as f64;
    assert!((found - period).abs() < 1e-7, "{found} {period}");
}

#[test]
fn a_hardening_spring_has_the_period_of_its_potential() {
    // The period is T = 4∫du/√(2(V(A) − V(u))/m) with V = ku²/2 + k₃u⁴/4.
    let (amplitude, k3) = (1e-3, 0.5 * STIFFNESS / 1e-6);
    let spring = Law::Spring {
        axis: 0,
        power: 3,
        coefficient: k3,
    };
    let (step, n) = (2e-3, 20_000);
    let period: f64 = (0..n)
        .map(|i| {
            let theta = (f64::from(i) + 0.5) / f64::from(n) * std::f64::consts::FRAC_PI_2;
            let u = amplitude * theta.sin();
            // `share` is (V(A) − V(u))/(A² − u²), without the singularity at the end of the range.
            let share = 0.5 * STIFFNESS + 0.25 * k3 * (amplitude * amplitude + u * u);
            4.0 * std::f64::consts::FRAC_PI_2 / f64::from(n) / (2.0 * share / MASS).sqrt()
        })
        .sum();
    let u = released(&one(0.0, &[spring], step), amplitude, step, 8000);
    let crossings: Vec<f64> = (1..u.len())
        .filter(|k| u[k - 1] < 0.0 && u[*k] >= 0.0)
        .map(|k| (k as f64 - u[k] / (u[k] - u[k - 1])) * step)
        .collect();
    let found = (crossings[crossings.len() - 1] - crossings[0]) / (crossings.len() - 1) as f64;
    assert!((found / period - 1.0).abs() < 1e-6, "{found} {period}");
}

#[test]
fn a_joint_dissipates_a_power_of_the_amplitude() {
    // To first order in s/k a cycle dissipates 4e/(e + 2)·s·A²·(A/u₀)^e of the energy ½·k·A²: A^−e grows by
    // 4e²/(e + 2)·(s/k)/u₀^e in each cycle.
    let (e, softening, start) = (0.6_f64, 2e-3 * STIFFNESS, 1e-3);
    let step = std::f64::consts::PI / OMEGA / 200.0;
    let mut system = one(0.0, &[], step);
    system.add_joint(0, Sliders::new(softening, e, start, 2.0 * start));
    let u = released(&system, start, step, 400 * 42);
    let tops: Vec<f64> = u
        .windows(3)
        .filter(|top| top[1] > 0.0 && top[0] < top[1] && top[1] >= top[2])
        .map(|top| top[1] - (top[2] - top[0]).powi(2) / (8.0 * (top[2] - 2.0 * top[1] + top[0])))
        .collect();
    let rise = (tops[39].powf(-e) - tops[0].powf(-e)) / 39.0;
    let wanted = 4.0 * e * e / (e + 2.0) * softening / STIFFNESS / start.powf(e);
    // Terms of the next order are s/k = 2e-3 of it.
    assert!((rise / wanted - 1.0).abs() < 6e-3, "{rise} {wanted}");
}
