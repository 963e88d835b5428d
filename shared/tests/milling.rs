//! The virtual cut compared with known limits and Floquet multipliers, because tests of the detector rely on it.

mod virtual_cut;

use virtual_cut::milling::{Complex, Cut, Milling, Process, machine_tool, robot};

/// |μ| over one tooth period, from the free motion of the linear equations without feed after a push.
fn multiplier_abs(process: Process, depth_mm: f64, steps: usize) -> f64 {
    let cut = Cut {
        depth_m: depth_mm * 1e-3,
        enter_s: 0.0,
        ramp_s: 0.0,
        leave_s: f64::INFINITY,
    };
    let process = Process {
        feed_per_tooth_m: 0.0,
        loses_contact: false,
        ..process
    };
    let mut milling = Milling::new(process, cut, steps);
    milling.push(Complex::new(1.0, 0.0));
    let mut states = Vec::new();
    for tooth in 0..200 {
        for _ in 0..steps {
            milling.advance();
        }
        if tooth >= 180 {
            states.push(milling.state().iter().flat_map(|q| [q.re, q.im]).collect());
        }
    }
    dominant_abs(&states)
}

/// The larger root of μ² = a·μ + b, where d[k+2] = a·d[k+1] + b·d[k] is fitted to all components of the deviations from the
/// orbit.
fn dominant_abs(deviations: &[Vec<f64>]) -> f64 {
    let (mut xx, mut xy, mut yy, mut xz, mut yz) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for window in deviations.windows(3) {
        // Each triple has the same weight, independent of the growth or decay up to it.
        let weight = 1.0 / window[1].iter().map(|d| d * d).sum::<f64>();
        for ((&y, &x), &z) in window[0].iter().zip(&window[1]).zip(&window[2]) {
            xx += weight * x * x;
            xy += weight * x * y;
            yy += weight * y * y;
            xz += weight * x * z;
            yz += weight * y * z;
        }
    }
    let determinant = xx * yy - xy * xy;
    if determinant < 1e-9 * xx * yy {
        // The deviations have a single real multiplier.
        return (xy / yy).abs();
    }
    let (a, b) = (
        (xz * yy - yz * xy) / determinant,
        (yz * xx - xz * xy) / determinant,
    );
    let square = 0.25 * a * a + b;
    if square < 0.0 {
        (-b).sqrt()
    } else {
        0.5 * a.abs() + square.sqrt()
    }
}

#[test]
fn robot_limits_are_met() {
    let limits = [
        (600.0, 3.174),
        (800.0, 1.664),
        (900.0, 1.723),
        (1050.0, 1.356),
        (1100.0, 2.223),
        (1200.0, 2.041),
        (1600.0, 2.953),
        (2000.0, 4.105),
        (2400.0, 5.443),
    ];
    for (rpm, limit_mm) in limits {
        let at = |share: f64| multiplier_abs(robot(rpm), share * limit_mm, 64);
        let (below, on, above) = (at(0.8), at(1.0), at(1.2));
        println!("{rpm}: {below:.4} {on:.5} {above:.4}");
        // The limit is stated to 0.5 µm, and |μ| changes by about 0.1 per relative change of depth.
        assert!((on - 1.0).abs() < 1e-4, "{rpm}: |μ| = {on} at the limit");
        assert!((0.970..0.984).contains(&below) && (1.014..1.031).contains(&above));
    }
}

#[test]
fn machine_tool_multipliers_are_met() {
    // Converged reference values of the two-degree-of-freedom benchmark of Insperger and Stépán at half immersion.
    for (rpm, depth_mm, reference) in REFERENCE {
        let found = multiplier_abs(machine_tool(rpm), depth_mm, 128);
        println!("{rpm} {depth_mm}: {found:.5} for {reference:.5}");
        assert!(
            (found - reference).abs() < 1e-3,
            "{rpm} rev/min, {depth_mm} mm: {found} for {reference}"
        );
    }
}

const REFERENCE: [(f64, f64, f64); 5] = [
    (5000.0, 0.5, 2.011416),
    (7500.0, 0.1, 0.931826),
    (9000.0, 0.5, 0.811795),
    (6200.0, 1.0, 3.064528),
    (10000.0, 1.0, 1.972650),
];
