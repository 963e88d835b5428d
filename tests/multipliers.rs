//! Growth of small motions per tooth passing, compared with reference Floquet multipliers.
//!
//! The references were computed by Chebyshev collocation of the monodromy operator and by a characteristic-matrix
//! Newton, which agree to 2e-8.

#![allow(clippy::unwrap_used)]

use quietcut::case::Case;
use quietcut::simulate::{
    Cutter, Cutting, Drive, Dynamics, Entry, Model, Motion, Regeneration, Settings, Spindle, VirtualCut,
    WorkpieceTraverse,
};
use quietcut::stability::orbit::ForcedProblem;
use quietcut::stability::{self, CubicTerms, Method, Pitched, Problem, RevolutionCollocation};
use quietcut_testkit::case;
use quietcut_tests::command::cases;

fn cutter(case: &Case, depth_mm: f64) -> Cutter {
    let (tool, material, cut) = (
        case.tool().unwrap(),
        case.material().unwrap(),
        case.cut().unwrap(),
    );
    let mut cutter = Cutter::new(tool, material, cut, 1e-3 * depth_mm).unwrap();
    cutter.axial_depth_modulation = case.axial_depth_modulation();
    cutter
}

/// A simulation of a case at full engagement from the start.
fn steady(case: &Case, spindle_rpm: f64, depth_mm: f64) -> Model {
    Model {
        dynamics: Dynamics::new(case.structure().unwrap()).unwrap(),
        cutting: Some(Cutting {
            cutter: cutter(case, depth_mm),
            spindle: Spindle::new(spindle_rpm),
            traverse: WorkpieceTraverse::Steady,
            regeneration: Regeneration::AllPasses,
            pores: None,
        }),
        drive: None,
        restoring_forces: Vec::new(),
    }
}

fn motions_from(
    model: &Model,
    states: Vec<f64>,
    settings: Settings,
    first_s: f64,
    every_s: f64,
    end_s: f64,
) -> Vec<Motion> {
    model
        .motions_from(states, settings, [first_s, every_s, end_s])
        .unwrap()
}

fn exact(relative: f64) -> Settings {
    Settings {
        absolute_m: 1e-4 * relative,
        relative,
        largest_m: f64::INFINITY,
        ..Settings::default()
    }
}

/// The motion from rest, at the times `first_s + k·every_s` up to `end_s`.
fn motions(model: &Model, settings: Settings, first_s: f64, every_s: f64, end_s: f64) -> Vec<Motion> {
    let at_rest = vec![0.0; model.dynamics.order()];
    motions_from(model, at_rest, settings, first_s, every_s, end_s)
}

/// The opposite of the cutting force without vibration, thesis eq. 3.6. With it, a tool at rest stays at rest.
struct Counterforce {
    case: Case,
    spindle_rpm: f64,
    depth_mm: f64,
}

impl Drive for Counterforce {
    fn force_n(&self, t: f64) -> [f64; 3] {
        let (tool, material, cut) = (
            self.case.tool().unwrap(),
            self.case.material().unwrap(),
            self.case.cut().unwrap(),
        );
        let (sin_g, cos_g) = tool.edge_angle_deg.to_radians().sin_cos();
        let mut sum = [0.0; 3];
        for j in 0..tool.teeth {
            let turn = t * self.spindle_rpm / 60.0 + j as f64 / tool.teeth as f64;
            let phi_deg = 360.0 * turn.rem_euclid(1.0);
            if !(cut.start_deg..cut.exit_deg).contains(&phi_deg) {
                continue;
            }
            let (sin, cos) = phi_deg.to_radians().sin_cos();
            let area = self.depth_mm * cut.feed_per_tooth_mm * sin * sin_g;
            let length = self.depth_mm / sin_g;
            let ft = material.kte_n_per_mm * length + material.ktc_mpa * area;
            let fr = material.kre_n_per_mm * length + material.krc_mpa * area;
            let fa = material.kae_n_per_mm * length + material.kac_mpa * area;
            sum[0] -= -cos * ft - sin * sin_g * fr - sin * cos_g * fa;
            sum[1] -= sin * ft - cos * sin_g * fr - cos * cos_g * fa;
            sum[2] -= cos_g * fr - sin_g * fa;
        }
        sum
    }
}

/// The largest Floquet multiplier of the linear model per tooth passing, from the growth of the motion after a push.
fn multiplier(case: &Case, spindle_rpm: f64, depth_mm: f64, periods: usize, order: usize) -> f64 {
    let period_s = case.tool().unwrap().tooth_period_s(spindle_rpm);
    multiplier_over(period_s, case, spindle_rpm, depth_mm, periods, order)
}

/// The largest Floquet multiplier over any period of the equations, from the growth of the motion after a push.
fn multiplier_over(
    period_s: f64,
    case: &Case,
    spindle_rpm: f64,
    depth_mm: f64,
    periods: usize,
    order: usize,
) -> f64 {
    let mut model = steady(case, spindle_rpm, depth_mm);
    let cutting = model.cutting.as_mut().unwrap();
    cutting.regeneration = Regeneration::LastPass;
    if case.axial_depth_modulation() {
        // The feed influences the growth, so it is kept and its force is balanced.
        model.drive = Some(Box::new(Counterforce {
            case: case.clone(),
            spindle_rpm,
            depth_mm,
        }));
    } else {
        cutting.cutter = cutting.cutter.clone().with_feed_per_tooth_m(0.0);
    }
    // The push acts on all states. It is so small that the terms quadratic in z of chapter 3 vanish.
    let push = (0..model.dynamics.order())
        .map(|i| 1e-10 * (1.0 + 0.3 * i as f64))
        .collect();
    let settings = Settings {
        // Balanced forces leave a rounding error of 1e-20 m.
        absolute_m: if model.drive.is_some() { 1e-18 } else { 1e-300 },
        relative: 1e-9,
        largest_m: f64::INFINITY,
        ..Settings::default()
    };
    // The end is not at an entry or exit of a tooth, where velocities may jump.
    let end_s = (periods as f64 + 0.5) * period_s;
    let motions = motions_from(&model, push, settings, 0.37 * period_s, period_s, end_s);
    largest_root(&motions[periods / 2..], order, 0.0)
}

/// The largest root of the linear recurrence that fits the sampled motion: of the order `order_max`, or of a lower one, if
/// a singular value of the fit is below the share `noise` of the largest. The motion then has fewer multipliers above its
/// noise, and further roots would be those of the noise.
fn largest_root(motions: &[Motion], order_max: usize, noise: f64) -> f64 {
    let (matrix, _) = recurrence(motions, order_max);
    let singular = matrix.svd(false, false).singular_values;
    let order = singular
        .iter()
        .filter(|value| **value > noise * singular.max())
        .count();
    let (matrix, right) = recurrence(motions, order);
    let coefficients = matrix.svd(true, true).solve(&right, 1e-9).unwrap();
    let mut companion = nalgebra::DMatrix::zeros(order, order);
    for i in 1..order {
        companion[(i - 1, i)] = 1.0;
    }
    companion.row_mut(order - 1).copy_from(&coefficients.transpose());
    companion
        .complex_eigenvalues()
        .iter()
        .map(|root| root.norm())
        .fold(0.0, f64::max)
}

/// The equations of a linear recurrence of this order for the sampled motion: its matrix and its right side. Each window
/// of the motion is scaled to 1.
fn recurrence(motions: &[Motion], order: usize) -> (nalgebra::DMatrix<f64>, nalgebra::DVector<f64>) {
    let size = |values: &[[f64; 3]]| values.iter().flatten().fold(0.0_f64, |a, b| a.max(b.abs()));
    let mut rows: Vec<Vec<f64>> = Vec::new();
    for window in motions.windows(order + 1) {
        let displacements: Vec<_> = window.iter().map(|m| m.displacement_m).collect();
        let velocities: Vec<_> = window.iter().map(|m| m.velocity_m_per_s).collect();
        for values in [displacements, velocities] {
            let size = size(&values);
            for axis in 0..3 {
                rows.push(values.iter().map(|value| value[axis] / size).collect());
            }
        }
    }
    let matrix = nalgebra::DMatrix::from_fn(rows.len(), order, |i, j| rows[i][j]);
    let right = nalgebra::DVector::from_fn(rows.len(), |i, _| rows[i][order]);
    (matrix, right)
}

#[test]
fn small_motions_grow_as_the_multipliers_say() {
    // Columns: case, rev/min, mm, |μ|; number of tooth passings, order of the recurrence.
    let rows = [
        ("insperger-1dof-ad1", 5000.0, 0.1, 0.7369621522396909, 200, 2),
        ("insperger-1dof-ad1", 5000.0, 2.0, 1.760635957779129, 200, 2),
        ("insperger-1dof-ad0.5", 10000.0, 2.0, 0.9551224981338414, 200, 2),
        ("insperger-1dof-ad0.1", 7500.0, 2.0, 1.0189579673573994, 200, 2),
        ("insperger-1dof-ad0.05", 10000.0, 3.5, 0.7620620645968945, 200, 2),
        ("insperger-2dof-ad1", 5000.0, 1.0, 10.903900564143019, 80, 4),
        ("insperger-2dof-ad0.5", 5000.0, 3.5, 12.245319019455795, 80, 4),
        ("insperger-2dof-ad0.1", 9000.0, 2.0, 0.7279095379148053, 200, 4),
        ("insperger-2dof-ad0.05", 10000.0, 2.0, 1.0457793014159975, 200, 4),
        (
            "kuka-kr90-full",
            1218.2398046759406,
            4.757894736842106,
            1.1147649406708513,
            300,
            4,
        ),
        (
            "kuka-kr90-full",
            1134.2232664224275,
            2.378947368421053,
            1.0274376847096318,
            300,
            4,
        ),
        (
            "kuka-kr90-half",
            822.31186815626,
            4.757894736842106,
            1.0690362418384487,
            300,
            4,
        ),
        (
            "kuka-kr90-half",
            378.0744221408092,
            4.757894736842106,
            1.0647473820534754,
            300,
            4,
        ),
        ("kuka-kr90-acetal", 600.0, 3.0, 0.9920059033470329, 300, 4),
        ("kuka-kr90-acetal", 1050.0, 1.5, 1.010189000512293, 300, 4),
        ("kuka-kr90-acetal", 1200.0, 3.0, 1.05349080078969, 300, 4),
        ("kuka-kr90-acetal", 2400.0, 1.5, 0.9394930840399833, 300, 4),
        ("staubli-tx200", 280.0, 0.67, 0.9571084840593427, 100, 6),
        ("staubli-tx200", 500.0, 0.67, 1.0009894776572472, 400, 4),
        ("staubli-tx200", 1000.0, 0.67, 0.988615316959107, 400, 6),
        ("staubli-tx200", 2800.0, 0.67, 0.9886461903814351, 400, 6),
    ];
    for (name, spindle_rpm, depth_mm, expected, periods, order) in rows {
        let found = multiplier(&case(name), spindle_rpm, depth_mm, periods, order);
        // The integration error is 1e-8 per tooth passing. The fit adds the contribution of other multipliers.
        assert!(
            (found - expected).abs() < 1e-5 * expected,
            "{name} {spindle_rpm} rev/min {depth_mm} mm: {found}, not {expected}"
        );
    }
}

/// A short force pulse during a simulation.
struct Push {
    at_s: f64,
    length_s: f64,
    force_n: f64,
}

impl Drive for Push {
    fn force_n(&self, t: f64) -> [f64; 3] {
        let u = (t - self.at_s) / self.length_s;
        let force = if (0.0..1.0).contains(&u) {
            self.force_n * (std::f64::consts::PI * u).sin()
        } else {
            0.0
        };
        [force, 0.5 * force, 0.0]
    }

    fn next_knot_s(&self, t: f64) -> f64 {
        let knots = [self.at_s, self.at_s + self.length_s];
        knots.into_iter().find(|knot| *knot > t).unwrap_or(f64::INFINITY)
    }
}

#[test]
fn a_small_disturbance_of_a_real_cut_grows_as_the_multiplier_says() {
    // The simulation has feed, surface memory and possible loss of contact. The forced orbit does not lose contact, and a small
    // disturbance of it grows as in the linear model.
    for (name, spindle_rpm, depth_mm, expected, order) in [
        ("kuka-kr90-acetal", 800.0, 1.5, 0.9879978476611608, 4),
        ("kuka-kr90-acetal", 1600.0, 1.5, 0.9420456657415937, 4),
        ("insperger-1dof-ad0.05", 6200.0, 0.5, 0.7714190218160983, 2),
    ] {
        let case = case(name);
        let model = steady(&case, spindle_rpm, depth_mm);
        let found = growth_of_a_push(model, tooth_period_s(&case, spindle_rpm), expected, order);
        // The tolerance covers the contribution of other multipliers, and loss of contact caused by the disturbance.
        assert!(
            (found - expected).abs() < 1e-4,
            "{name} {spindle_rpm}: {found}, not {expected}"
        );
    }
}

fn tooth_period_s(case: &Case, spindle_rpm: f64) -> f64 {
    case.tool().unwrap().tooth_period_s(spindle_rpm)
}

/// The Floquet multiplier of a cut over a period, from the growth of a small disturbance. `expected` is its approximate value.
fn growth_of_a_push(mut model: Model, period_s: f64, expected: f64, order: usize) -> f64 {
    let cutting = model.cutting.as_ref().unwrap();
    // Number of periods after which transients have decayed to 1e-10 of the feed, with an upper bound. The push is about 1e-5 of
    // the feed.
    let calm = (-23.0 / f64::ln(expected)).min(1500.0);
    // Number of periods until a thousandth of the disturbance is left.
    let watched = (-7.0 / f64::ln(expected)).min(60.0);
    let force_n = cutting.cutter.depth_m;
    let mut run = |force_n: f64| {
        model.drive = Some(Box::new(Push {
            at_s: calm * period_s,
            length_s: 0.2 * period_s,
            force_n,
        }));
        let (first_s, end_s) = ((calm + 3.37) * period_s, (calm + watched) * period_s);
        motions(&model, exact(1e-12), first_s, period_s, end_s)
    };
    let (with, without) = (run(force_n), run(0.0));
    let difference = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|axis| a[axis] - b[axis]);
    let disturbance: Vec<Motion> = with
        .iter()
        .zip(&without)
        .map(|(a, b)| Motion {
            displacement_m: difference(a.displacement_m, b.displacement_m),
            velocity_m_per_s: difference(a.velocity_m_per_s, b.velocity_m_per_s),
            acceleration_m_per_s2: None,
            force_n: [0.0; 3],
        })
        .collect();
    // The difference of two simulations has an error of about 1e-6 of the disturbance, and more after its decay.
    largest_root(&disturbance[8..], order, 2e-4)
}

#[test]
fn disturbances_of_unequal_teeth_with_cubic_terms_grow_as_their_multipliers_say() {
    let runout = quietcut::milling::Runout {
        offset_um: 40.0,
        angle_deg: 30.0,
    };
    for (pitch_deg, runout, rpm, depth_mm) in [
        ([165.0, 195.0], None, 550.0, 9.0),
        ([180.0, 180.0], Some(runout), 550.0, 9.0),
    ] {
        let plain = case("kuka-kr90-half-cubic");
        let mut uneven = plain.clone();
        let tool = uneven.tool.as_mut().unwrap();
        (tool.pitch_deg, tool.runout) = (pitch_deg.to_vec(), runout);
        let at = |case: &Case| ForcedProblem::new(case).unwrap().point(rpm, depth_mm).unwrap();
        let (expected, equal) = (at(&uneven).multiplier_abs, at(&plain).multiplier_abs.powi(2));
        let cut = VirtualCut {
            entry: Entry::None,
            ..VirtualCut::new(rpm, depth_mm, 1.0)
        };
        let mut model = cut.model(&uneven).unwrap();
        model.cutting.as_mut().unwrap().regeneration = Regeneration::LastPass;
        let found = growth_of_a_push(model, 60.0 / rpm, expected, 4);
        println!("{pitch_deg:?} {runout:?}: {found} {expected}, equal teeth {equal}");
        // The error has contributions of other multipliers and of the square of the disturbance. The change due to unequal pitch
        // is at least ten times as large.
        let (error, change) = ((found - expected).abs(), (equal - expected).abs());
        assert!(error < 3e-5, "{pitch_deg:?}: {found} {expected}");
        assert!(change > 10.0 * error, "{pitch_deg:?}: {equal} {expected}");
    }
}

#[test]
fn disturbances_of_extended_cases_grow_as_their_multipliers_say() {
    let flank = "[extension.process-damping]\nprocess_damping_n_per_m = 3e4\nfriction = 0.3\n";
    let chip = "[extension.force-exponent]\nexponent = 0.7\nreference_chip_mm = 0.05\n";
    let spring = "[extension.cubic-stiffness]\nk3_n_per_m3 = 8e14\ndirection = \"x\"\n";
    let turn =
        "[extension.softening-hardening]\nk3_n_per_m3 = -4e14\nk5_n_per_m5 = 3e24\ndirection = \"x\"\n";
    let quintic = "[extension.quintic-stiffness]\nk5_n_per_m5 = 4e24\ndirection = \"x\"\n";
    let shared =
        "[extension.mode-coupling]\nkxyy_n_per_m3 = 4e14\nkxxy_n_per_m2 = 2e9\ndirections = [\"x\", \"y\"]\n";
    let squared = "[extension.quadratic-damping]\nc2_ns2_per_m2 = 60.0\ndirection = \"x\"\n";
    let mode = "[extension.missing-mode]\nfrequency_hz = 700.0\nmodal_mass_kg = 0.1\ndirection = \"x\"\n";
    let material = "[extension.force-coefficients]\nktc_mpa = 750.0\n[extension.stiffness]\nstiffness_n_per_m = 1.5e6\ndirection = \"x\"\n";
    let two = "insperger-2dof-ad0.5";
    for (name, extension) in [
        ("insperger-1dof-ad0.5", flank),
        (two, flank),
        (two, chip),
        (two, spring),
        (two, turn),
        (two, quintic),
        (two, shared),
        (two, squared),
        (two, mode),
        (two, material),
    ] {
        let path = cases().join(format!("{name}.toml"));
        // At zero chip thickness a chip law has no derivative. Between 60 and 120 degrees the chip thickness is positive.
        let text = std::fs::read_to_string(&path).unwrap();
        let text = text
            .replace("teeth = 2", "teeth = 2\ndiameter_mm = 20.0")
            .replace("start_deg = 90.0", "start_deg = 60.0")
            .replace("exit_deg = 180.0", "exit_deg = 120.0");
        let extended = Case::parse(path.as_ref(), &format!("{text}\n{extension}")).unwrap();
        let rpm = 6200.0;
        let at = |depth_mm: f64| {
            if stability::needs_orbit(&extended) {
                // The orbit may vanish in a fold below this depth. Then there is nothing to disturb.
                ForcedProblem::new(&extended).unwrap().point(rpm, depth_mm).ok()
            } else {
                let problem = Problem::new(&extended, CubicTerms::Refuse).unwrap();
                Some(stability::point(&problem, rpm, depth_mm).unwrap())
            }
        };
        // The depth is large enough that the disturbance decays slowly and can be measured.
        let (depth_mm, expected) = (1..20)
            .map(|step| 0.1 * f64::from(step))
            .filter_map(|depth_mm| Some((depth_mm, at(depth_mm)?)))
            .min_by_key(|(_, point)| (1e9 * (point.multiplier_abs - 0.92).abs()) as u64)
            .unwrap();
        let plain = Case::parse(path.as_ref(), &text).unwrap();
        let plain =
            stability::point(&Problem::new(&plain, CubicTerms::Refuse).unwrap(), rpm, depth_mm).unwrap();
        let cut = VirtualCut {
            entry: Entry::None,
            ..VirtualCut::new(rpm, depth_mm, 1.0)
        };
        let order = if name == two { 4 } else { 2 };
        let found = growth_of_a_push(
            cut.model(&extended).unwrap(),
            tooth_period_s(&extended, rpm),
            expected.multiplier_abs,
            order,
        );
        println!(
            "{name} {extension}: {found} {} plain {}",
            expected.multiplier_abs, plain.multiplier_abs
        );
        // The error comes from the multiplier of the other direction, which is almost as large. The extension changes the
        // multiplier by far more.
        let tolerance = 1e-3;
        assert!(
            (found - expected.multiplier_abs).abs() < tolerance,
            "{extension}: {found} {expected:?}"
        );
        assert!(
            (plain.multiplier_abs - expected.multiplier_abs).abs() > tolerance,
            "{extension}"
        );
    }
}

#[test]
fn small_motions_of_tools_with_variable_pitch_grow_as_collocation_over_the_revolution_says() {
    // Columns: case, pitches, rev/min, mm, order of the recurrence.
    let rows: [(&str, &[f64], f64, f64, usize); 4] = [
        ("insperger-1dof-ad1", &[170.0, 190.0], 5000.0, 0.5, 2),
        ("insperger-1dof-ad0.1", &[100.0, 125.0, 135.0], 7500.0, 2.0, 2),
        (
            "insperger-2dof-ad0.5",
            &[70.0, 110.0, 70.0, 110.0],
            6200.0,
            0.2,
            4,
        ),
        ("insperger-2dof-ad1", &[62.0, 71.0, 93.0, 134.0], 7500.0, 0.1, 4),
    ];
    for (name, pitch_deg, spindle_rpm, depth_mm, order) in rows {
        let mut case = case(name);
        let tool = case.tool.as_mut().unwrap();
        tool.teeth = pitch_deg.len();
        tool.pitch_deg = pitch_deg.to_vec();
        let method = RevolutionCollocation {
            pitched: Pitched::new(&case, CubicTerms::Refuse).unwrap(),
        };
        let expected = method.point(spindle_rpm, depth_mm).unwrap().multiplier_abs;
        let found = multiplier_over(60.0 / spindle_rpm, &case, spindle_rpm, depth_mm, 60, order);
        println!("{name} {pitch_deg:?}: {found} {expected}");
        // The integration error is 1e-9 per step, over some hundred steps per revolution.
        assert!(
            (found / expected - 1.0).abs() < 1e-5,
            "{name} {pitch_deg:?}: {found} {expected}"
        );
    }
}
