//! Exact derivatives of limits against finite differences of limits, and against closed forms.

use crate::*;
use quietcut_model::case::{Case, Parameter};
use quietcut_model::structure::Form;
use quietcut_testkit::case;

fn problem(case: &Case) -> Problem {
    Problem::new(case, CubicTerms::LeaveOut).unwrap()
}

/// Derivative dw/dp, mm, of the depth of the nearest switch of the same kind, from lines at the steps ±h and ±2h of the
/// parameter; the error is of order h⁴.
fn by_differences(switch: &Switch, rpm: f64, depth_mm: f64, h: f64, at: impl Fn(f64) -> Problem) -> f64 {
    let depth = |step: f64| {
        let line = line(&at(step * h), rpm, depth_mm, 40).unwrap();
        line.switches
            .iter()
            .filter(|other| other.kind == switch.kind && other.gain == switch.gain)
            .map(|other| other.depth_mm)
            .min_by(|a, b| {
                (a - switch.depth_mm)
                    .abs()
                    .total_cmp(&(b - switch.depth_mm).abs())
            })
            .unwrap()
    };
    (8.0 * (depth(1.0) - depth(-1.0)) - (depth(2.0) - depth(-2.0))) / (12.0 * h)
}

/// Asserts that a derivative agrees with its difference quotient to 1e-4, relative to the quotient or to a tenth of
/// `size` if that is larger. Limits are accurate to 1e-9 and relative steps are 3e-5 or more.
fn assert_close(exact: f64, differences: f64, size: f64, what: &str) {
    assert!(
        (exact - differences).abs() < 1e-4 * differences.abs().max(0.1 * size),
        "{what}: {exact} exact, {differences} by differences"
    );
}

const CASES: [(&str, &[f64], f64); 5] = [
    ("kuka-kr90-acetal", &[812.0, 1036.0, 1045.0, 1100.0, 1733.0], 5.0),
    ("staubli-tx200", &[300.0, 500.0], 2.0),
    ("kuka-kr90-full", &[750.0, 1136.0], 6.0),
    ("insperger-2dof-ad0.05", &[7500.0, 20_000.0], 8.0),
    ("insperger-1dof-ad0.5", &[5000.0, 9100.0], 4.0),
];

#[test]
fn derivatives_by_modes_and_ktc_are_those_of_differences() {
    let mut count = 0;
    for (name, speeds, depth_mm) in CASES {
        let problem = problem(&case(name));
        let modes = problem.structure.modal_parts();
        for &rpm in speeds {
            for switch in line(&problem, rpm, depth_mm, 40).unwrap().switches {
                let sensitivity = Sensitivity::new(&problem, rpm, &switch).unwrap();
                let what = format!("{name}, {rpm} rev/min, {} mm", switch.depth_mm);
                for (index, mode) in modes.iter().enumerate() {
                    let slope = sensitivity.slope(&Tangent::omega(&problem, mode)).unwrap();
                    let moved = |by: f64| {
                        let mut moved = problem.clone();
                        moved.structure.a += mode.by_omega() * (by * mode.omega());
                        moved
                    };
                    let differences = by_differences(&switch, rpm, depth_mm, 3e-5, moved);
                    let exact = slope.depth_mm * mode.omega();
                    assert_close(
                        exact,
                        differences,
                        switch.depth_mm,
                        &format!("{what}, ω of mode {index}"),
                    );

                    let slope = sensitivity
                        .slope(&Tangent::damping_ratio(&problem, mode))
                        .unwrap();
                    let damped = |by: f64| {
                        let mut moved = problem.clone();
                        let (omega, zeta) = (mode.omega(), mode.damping_ratio());
                        let (from, to) = (zeta, zeta * (1.0 + by));
                        // Pole of the mode at another damping ratio. `moved` changes A so that the pole moves by the
                        // given amount.
                        let pole = |zeta: f64| {
                            num_complex::Complex64::new(-zeta, (1.0 - zeta * zeta).sqrt()) * omega
                        };
                        let change = pole(to) - pole(from);
                        moved.structure.a += mode.moved(change);
                        moved
                    };
                    let differences = by_differences(&switch, rpm, depth_mm, 2e-3, damped);
                    let exact = slope.depth_mm * mode.damping_ratio();
                    assert_close(
                        exact,
                        differences,
                        switch.depth_mm,
                        &format!("{what}, ζ of mode {index}"),
                    );
                    count += 1;
                }
                let slope = sensitivity.slope(&Tangent::cutting_force(&problem)).unwrap();
                let harder = |by: f64| {
                    let mut harder = problem.clone();
                    let cutting = &mut harder.process.force.cutting;
                    for part in [&mut cutting.constant, &mut cutting.cosine, &mut cutting.sine] {
                        *part *= 1.0 + by;
                    }
                    harder
                };
                let differences = by_differences(&switch, rpm, depth_mm, 2e-3, harder);
                assert_close(
                    slope.depth_mm,
                    differences,
                    switch.depth_mm,
                    &format!("{what}, Ktc"),
                );
                if !problem.process.axial_depth_modulation {
                    // Only the product w K_tc enters the equation, so that dw/w = −dK_tc/K_tc at a limit.
                    assert!(
                        (slope.depth_mm + switch.depth_mm).abs() < 1e-6 * switch.depth_mm,
                        "{what}"
                    );
                }
            }
        }
    }
    println!("{count} derivatives by modes");
    assert!(count > 30, "{count}");
}

/// Every parameter of a case that may have a standard deviation, with a step that is small against its value.
fn parameters(case: &Case) -> Vec<(Parameter, f64)> {
    let mut all: Vec<Parameter> = vec![
        Parameter::Ktc,
        Parameter::Krc,
        Parameter::Kac,
        Parameter::Start,
        Parameter::FeedDirection,
    ];
    if case.axial_depth_modulation() {
        all.extend([
            Parameter::Kte,
            Parameter::Kre,
            Parameter::Kae,
            Parameter::FeedPerTooth,
        ]);
        all.push(Parameter::EdgeAngle);
    }
    match &case.structure().unwrap().form {
        Form::Modes(modes) => {
            for mode in 0..modes.len() {
                all.extend([Parameter::Frequency(mode), Parameter::DampingRatio(mode)]);
                all.extend([Parameter::Left(mode, 1, false), Parameter::Left(mode, 0, true)]);
                all.extend([Parameter::Right(mode, 1, true), Parameter::Right(mode, 0, false)]);
            }
        }
        Form::Matrices(_) | Form::Joints(_) => {
            all.extend([
                Parameter::Mass(0, 0),
                Parameter::Damping(0, 0),
                Parameter::Stiffness(0, 0),
            ]);
        }
    }
    all.into_iter()
        .filter_map(|parameter| {
            let value = parameter.value(case)?;
            // A parameter with the value 0 (an angle, an entry of a mode shape) has no size; its step is 0.01.
            Some((parameter, if value == 0.0 { 1e-2 } else { 3e-4 * value.abs() }))
        })
        .collect()
}

#[test]
fn derivatives_by_every_parameter_of_the_case_file_are_those_of_differences() {
    let mut count = 0;
    for (name, rpm, depth_mm) in [
        ("kuka-kr90-acetal", 1036.0, 4.0),
        ("kuka-kr90-acetal", 1045.0, 4.0),
        ("staubli-tx200", 500.0, 1.0),
    ] {
        let mut case = case(name);
        let cut = case.cut.as_mut().unwrap();
        // Moves the exit angle away from the end of its range, so that it can be varied to both sides.
        cut.exit_deg -= 3.0;
        cut.feed_direction_deg = 20.0;
        let problem = problem(&case);
        for switch in line(&problem, rpm, depth_mm, 40).unwrap().switches {
            let sensitivity = Sensitivity::new(&problem, rpm, &switch).unwrap();
            for (parameter, step) in parameters(&case).into_iter().chain([(Parameter::Exit, 3e-2)]) {
                let moved = |by: f64| {
                    let mut moved = case.clone();
                    assert!(parameter.shift(&mut moved, by * step), "{parameter:?}");
                    self::problem(&moved)
                };
                let tangent = Tangent::between(&moved(-0.1), &moved(0.1), 0.2);
                let exact = sensitivity.slope(&tangent).unwrap().depth_mm;
                let differences = by_differences(&switch, rpm, depth_mm, 1.0, moved);
                // Derivatives are per step, and steps are about 3e-4 of the parameter.
                let size = 3e-4 * switch.depth_mm;
                assert_close(
                    exact,
                    differences,
                    size,
                    &format!("{name} {switch:?} {parameter:?}"),
                );
                count += 1;
            }
        }
    }
    println!("{count} derivatives by parameters");
    assert!(count > 30, "{count}");
}

#[test]
fn derivatives_by_frequency_and_speed_fulfil_eulers_theorem() {
    // If all poles and the spindle speed Ω are multiplied by one factor with constant residues, the receptance H = R/(s
    // − λ) is divided by it and the limit w multiplied by it. Hence w = ω ∂w/∂ω + Ω ∂w/∂Ω (Euler's theorem), where ω
    // stands for the frequencies of all modes.
    let case = case("kuka-kr90-acetal");
    let problem = problem(&case);
    for rpm in [812.0, 1045.0, 1300.0] {
        let limit = |rpm: f64| line(&problem, rpm, 5.0, 40).unwrap().switches[0];
        let sensitivity = Sensitivity::new(&problem, rpm, &limit(rpm)).unwrap();
        let by_frequency: f64 = problem
            .structure
            .modal_parts()
            .iter()
            .map(|mode| {
                let slope = sensitivity.slope(&Tangent::omega(&problem, mode)).unwrap();
                slope.depth_mm * mode.omega()
            })
            .sum();
        let h = 2e-4 * rpm;
        let depth = |step: f64| limit(rpm + step * h).depth_mm;
        let by_speed = (8.0 * (depth(1.0) - depth(-1.0)) - depth(2.0) + depth(-2.0)) / (12.0 * h);
        let depth_mm = limit(rpm).depth_mm;
        assert!(
            (by_frequency + rpm * by_speed - depth_mm).abs() < 1e-4 * depth_mm.max((rpm * by_speed).abs()),
            "{rpm}: {by_frequency} {} {depth_mm}",
            rpm * by_speed
        );
    }
}
