//! Properties of limits that hold for every machine and cut: scaling laws, rotation of the axes, vanishing damping and
//! depth, closed forms for constant coefficients. Methods that use receptances are compared with the default method on
//! random machines.
//!
//! A case that fails is shrunk and printed with all its parameters. A campaign of minutes: `QUIETCUT_RANDOM_CASES=300
//! cargo test --release -p quietcut-stability --lib -- tests::properties`

use std::f64::consts::{PI, TAU};

use nalgebra::{DMatrix, Matrix2};
use num_complex::Complex64;
use proptest::prelude::*;

use crate::*;
use quietcut_model::milling::{Cut, Material, Process, Tool};
use quietcut_model::structure::{Direction, Form, Matrices, Structure, feed_axes};

/// Structure with two coupled modes in feed and normal direction, and a cut.
#[derive(Clone, Debug)]
struct Machine {
    /// Natural frequencies, rad/s.
    omega: [f64; 2],
    /// Damping ratios.
    zeta: [f64; 2],
    /// Modal masses, kg.
    mass: [f64; 2],
    /// Angle between the direction of the first mode and the feed, rad.
    lean: f64,
    teeth: usize,
    start_deg: f64,
    exit_deg: f64,
    ktc_mpa: f64,
    krc_ratio: f64,
    /// Number of vibrations of the slower mode in a tooth period.
    vibrations: f64,
}

fn machines() -> impl Strategy<Value = Machine> {
    let structure = (
        (50.0..500.0, 1.05..3.0),
        [0.01..0.1, 0.01..0.1],
        [1.0..200.0, 1.0..200.0],
        0.0..PI,
    );
    let cut = (
        1usize..=6,
        0.0..150.0,
        20.0..120.0,
        50.0..1500.0,
        0.1..0.7,
        0.3..3.0,
    );
    (structure, cut).prop_map(
        |(((slow, ratio), zeta, mass, lean), (teeth, start_deg, arc, ktc_mpa, krc_ratio, vibrations))| {
            Machine {
                omega: [slow, slow * ratio],
                zeta,
                mass,
                lean,
                teeth,
                start_deg,
                exit_deg: f64::min(start_deg + arc, 180.0),
                ktc_mpa,
                krc_ratio,
                vibrations,
            }
        },
    )
}

impl Machine {
    /// Mass, damping and stiffness in feed and normal direction.
    fn matrices(&self) -> [DMatrix<f64>; 3] {
        let (sin, cos) = self.lean.sin_cos();
        let turn = Matrix2::new(cos, -sin, sin, cos);
        let diagonal = |entry: fn(f64, f64, f64) -> f64| {
            let at = |i: usize| entry(self.mass[i], self.omega[i], self.zeta[i]);
            let matrix = turn * Matrix2::new(at(0), 0.0, 0.0, at(1)) * turn.transpose();
            DMatrix::from_fn(2, 2, |i, j| matrix[(i, j)])
        };
        [
            diagonal(|mass, _, _| mass),
            diagonal(|mass, omega, zeta| 2.0 * zeta * omega * mass),
            diagonal(|mass, omega, _| omega * omega * mass),
        ]
    }

    fn structure(&self, [mass, damping, stiffness]: [DMatrix<f64>; 3]) -> Structure {
        Structure {
            directions: vec![Direction::X, Direction::Y],
            form: Form::Matrices(Matrices {
                mass,
                damping,
                stiffness,
                cubic_damping: None,
                cubic_stiffness: None,
            }),
        }
    }

    fn process(&self, force_factor: f64) -> Process {
        let tool = Tool {
            teeth: self.teeth,
            edge_angle_deg: 90.0,
            diameter_mm: None,
            pitch_deg: vec![360.0 / self.teeth as f64; self.teeth],
            runout: None,
        };
        let material = Material {
            ktc_mpa: self.ktc_mpa * force_factor,
            krc_mpa: self.ktc_mpa * self.krc_ratio * force_factor,
            kac_mpa: 0.0,
            kte_n_per_mm: 0.0,
            kre_n_per_mm: 0.0,
            kae_n_per_mm: 0.0,
        };
        let cut = Cut {
            start_deg: self.start_deg,
            exit_deg: self.exit_deg,
            feed_per_tooth_mm: 0.1,
            feed_direction_deg: 0.0,
        };
        Process::new(&tool, &material, &cut, false)
    }

    fn problem_of(&self, matrices: [DMatrix<f64>; 3], force_factor: f64) -> Problem {
        Problem {
            structure: self.structure(matrices).first_order().unwrap(),
            process: self.process(force_factor),
            teeth: self.teeth,
        }
    }

    fn problem(&self) -> Problem {
        self.problem_of(self.matrices(), 1.0)
    }

    fn rpm(&self) -> f64 {
        60.0 * self.omega[0] / TAU / self.vibrations / self.teeth as f64
    }

    /// Axial depth, mm, at which w K_tc equals the stiffness of the softer mode: deeper than most first limits.
    fn depth_mm(&self) -> f64 {
        let softest = (0..2)
            .map(|i| self.mass[i] * self.omega[i] * self.omega[i])
            .fold(f64::INFINITY, f64::min);
        softest / (self.ktc_mpa * 1e6) * 1e3
    }
}

fn depths(problem: &Problem, rpm: f64, depth_mm: f64) -> Vec<(f64, StabilityLoss, bool)> {
    let switches = line(problem, rpm, depth_mm, 40).unwrap().switches;
    switches
        .iter()
        .map(|switch| (switch.depth_mm, switch.kind, switch.gain))
        .collect()
}

/// True if the limits `a`, with depths times `factor`, are the limits `b` up to a relative tolerance; limits at the
/// last depth are not compared.
fn same(
    a: &[(f64, StabilityLoss, bool)],
    factor: f64,
    b: &[(f64, StabilityLoss, bool)],
    last_mm: f64,
    tolerance: f64,
) -> bool {
    let inside = |depth: f64| depth < last_mm * (1.0 - 1e-6);
    let a: Vec<_> = a
        .iter()
        .map(|x| (x.0 * factor, x.1, x.2))
        .filter(|x| inside(x.0))
        .collect();
    let b: Vec<_> = b.iter().filter(|x| inside(x.0)).collect();
    a.len() == b.len()
        && a.iter()
            .zip(b)
            .all(|(x, y)| (x.0 - y.0).abs() <= tolerance * y.0 && x.1 == y.1 && x.2 == y.2)
}

/// Relative tolerance of limits: each is solved for to 1e-9, and a scaled problem has another mesh.
const LIMIT: f64 = 1e-7;

/// Number of random cases: that of QUIETCUT_RANDOM_CASES, otherwise `cases`.
fn config(cases: u32) -> ProptestConfig {
    let asked = std::env::var("QUIETCUT_RANDOM_CASES").ok();
    ProptestConfig {
        cases: asked.and_then(|count| count.parse().ok()).unwrap_or(cases),
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

proptest! {
    #![proptest_config(config(20))]

    #[test]
    fn a_stiffer_structure_and_a_stiffer_chip_by_the_same_factor_change_nothing(
        machine in machines(), factor in 0.01..100.0_f64,
    ) {
        let (rpm, depth_mm) = (machine.rpm(), machine.depth_mm());
        let scaled = machine.problem_of(machine.matrices().map(|matrix| matrix * factor), factor);
        let (a, b) = (depths(&machine.problem(), rpm, depth_mm), depths(&scaled, rpm, depth_mm));
        prop_assert!(same(&a, 1.0, &b, depth_mm, LIMIT), "{a:?} {b:?}");
    }

    #[test]
    fn a_stiffer_chip_alone_makes_limits_shallower_by_the_factor(machine in machines(), factor in 0.1..10.0_f64) {
        let (rpm, depth_mm) = (machine.rpm(), machine.depth_mm());
        let scaled = machine.problem_of(machine.matrices(), factor);
        let (a, b) = (depths(&machine.problem(), rpm, depth_mm), depths(&scaled, rpm, depth_mm / factor));
        prop_assert!(same(&a, 1.0 / factor, &b, depth_mm / factor, LIMIT), "{a:?} {b:?}");
    }

    #[test]
    fn a_machine_as_much_faster_as_the_spindle_has_limits_deeper_by_the_square(
        machine in machines(), factor in 0.1..10.0_f64,
    ) {
        let (rpm, depth_mm, square) = (machine.rpm(), machine.depth_mm(), factor * factor);
        let faster = Machine { omega: machine.omega.map(|omega| omega * factor), ..machine.clone() };
        let (a, b) = (
            depths(&machine.problem(), rpm, depth_mm),
            depths(&faster.problem(), rpm * factor, depth_mm * square),
        );
        prop_assert!(same(&a, square, &b, depth_mm * square, LIMIT), "{a:?} {b:?}");
        let at = |machine: &Machine, rpm, depth_mm| point(&machine.problem(), rpm, depth_mm).unwrap().multiplier;
        let (p, q) = (at(&machine, rpm, 0.3 * depth_mm), at(&faster, rpm * factor, 0.3 * depth_mm * square));
        prop_assert!((p - q).norm() < 1e-7 * p.norm().max(1.0), "{p} {q}");
    }

    #[test]
    fn rotating_feed_and_structure_together_changes_nothing(machine in machines(), angle_deg in -180.0..180.0_f64) {
        let axes = feed_axes(angle_deg);
        let turn = DMatrix::from_fn(2, 2, |i, j| axes[(i, j)]);
        let turned = machine.matrices().map(|matrix| &turn * matrix * turn.transpose());
        let mut problem = machine.problem_of(turned, 1.0);
        problem.structure = problem.structure.rotated(angle_deg);
        let (rpm, depth_mm) = (machine.rpm(), machine.depth_mm());
        let (a, b) = (depths(&machine.problem(), rpm, depth_mm), depths(&problem, rpm, depth_mm));
        prop_assert!(same(&a, 1.0, &b, depth_mm, LIMIT), "{a:?} {b:?}");
    }

    /// At depth 0 the multiplier is that of the free structure; its change is proportional to a small depth.
    #[test]
    fn as_the_depth_vanishes_multipliers_are_those_of_the_free_structure(machine in machines()) {
        let (problem, rpm, depth_mm) = (machine.problem(), machine.rpm(), machine.depth_mm());
        let free = problem
            .structure
            .poles()
            .iter()
            .map(|pole| (pole * problem.tooth_period_s(rpm)).exp().norm())
            .fold(0.0, f64::max);
        let gap = |share: f64| (point(&problem, rpm, share * depth_mm).unwrap().multiplier_abs - free).abs();
        prop_assert!(gap(0.0) < 1e-9);
        let (far, near) = (gap(1e-5), gap(1e-6));
        // A tenth of the depth changes |μ| by a tenth, apart from second order and rounding.
        prop_assert!((near - 0.1 * far).abs() < 0.01 * far + 1e-9, "{far} {near}");
    }

    /// Four teeth at full immersion, one mode along the feed: the coefficients are constant, as in turning, and
    /// w = 1/(2 α_xx Re H) with ωτ = π − 2 arg(1/H α_xx) + 2πk for every chatter frequency.
    #[test]
    fn limits_of_turning_are_those_of_the_closed_form(
        omega in 100.0..5000.0_f64, zeta in 0.005..0.2_f64, mass in 0.1..100.0_f64,
        above in 0.02..0.5_f64, lobe in 0usize..4, krc_ratio in 0.1..0.7_f64,
    ) {
        let (problem, alpha) = turning(omega, zeta, mass, krc_ratio);
        // α_xx is negative, so that α_xx Re H > 0 only above the resonance. The frequency starts where |Re H| is large
        // enough for the test.
        let chatter = omega * (1.0 + 0.6 * zeta + above);
        let h = problem.structure.receptance(chatter).unwrap()[(0, 0)];
        let inverse = (h * alpha).inv();
        prop_assume!(inverse.re > 0.0);
        let depth_mm = 1e3 / (2.0 * alpha * h.re);
        let delay_s = (PI - 2.0 * inverse.arg() + TAU * lobe as f64) / chatter;
        let rpm = 60.0 / (4.0 * delay_s);
        let found = line(&problem, rpm, 1.2 * depth_mm, 40).unwrap().switches;
        let nearest = found
            .iter()
            .min_by(|p, q| (p.depth_mm - depth_mm).abs().total_cmp(&(q.depth_mm - depth_mm).abs()))
            .unwrap();
        prop_assert!((nearest.depth_mm - depth_mm).abs() < 1e-7 * depth_mm, "{nearest:?} {depth_mm}");
    }

    /// The smallest limit of turning is 2kζ(1 + ζ)/|α_xx| with the modal stiffness k: it vanishes with the damping
    /// ratio ζ.
    #[test]
    fn as_damping_vanishes_so_does_the_least_limit(
        omega in 100.0..5000.0_f64, mass in 0.1..100.0_f64, krc_ratio in 0.1..0.7_f64, exponent in 2.0..5.0_f64,
    ) {
        let zeta = 10.0_f64.powf(-exponent);
        let (problem, alpha) = turning(omega, zeta, mass, krc_ratio);
        let stiffness = mass * omega * omega;
        let least_mm = 1e3 * 2.0 * stiffness * zeta * (1.0 + zeta) / alpha.abs();
        // Frequency ω√(1 + 2ζ) at which Re H is smallest, in the first lobe.
        let chatter = omega * (1.0 + 2.0 * zeta).sqrt();
        let h = problem.structure.receptance(chatter).unwrap()[(0, 0)];
        let delay_s = (PI - 2.0 * (h * alpha).inv().arg() + TAU) / chatter;
        let limit = line(&problem, 60.0 / (4.0 * delay_s), 3.0 * least_mm, 40).unwrap().first_limit.unwrap();
        prop_assert!((limit.depth_mm - least_mm).abs() < 1e-7 * least_mm, "{limit:?} {least_mm}");
    }
}

/// Problem with constant coefficients: one mode along the feed under four teeth at full immersion. Also returns the
/// coefficient α_xx, Pa.
fn turning(omega: f64, zeta: f64, mass: f64, krc_ratio: f64) -> (Problem, f64) {
    let machine = Machine {
        omega: [omega; 2],
        zeta: [zeta; 2],
        mass: [mass; 2],
        lean: 0.0,
        teeth: 4,
        start_deg: 0.0,
        exit_deg: 180.0,
        ktc_mpa: 600.0,
        krc_ratio,
        vibrations: 1.0,
    };
    let one = |matrix: DMatrix<f64>| matrix.remove_row(1).remove_column(1);
    let structure = Structure {
        directions: vec![Direction::X],
        ..machine.structure(machine.matrices().map(one))
    };
    let process = machine.process(1.0);
    let alpha = process.force.averaged(&process.engagement, 0.0).directional[(0, 0)];
    let problem = Problem {
        structure: structure.first_order().unwrap(),
        process,
        teeth: 4,
    };
    (problem, alpha)
}

/// Two loci pass close by each other near the real axis: if they were exchanged, crossings would lie elsewhere.
#[test]
fn loci_that_nearly_meet_are_not_exchanged() {
    let machine = Machine {
        omega: [50.0, 54.70051932559452],
        zeta: [0.01, 0.012826296196247138],
        mass: [188.0502585507614, 108.44058118579443],
        lean: 1.5447941011783048,
        teeth: 6,
        start_deg: 0.0,
        exit_deg: 68.47244169041558,
        ktc_mpa: 50.0,
        krc_ratio: 0.5533631694821489,
        vibrations: 2.765409410830729,
    };
    let (problem, rpm, depth_mm) = (machine.problem(), machine.rpm(), machine.depth_mm());
    let method = MultiFrequency {
        problem: FrequencyProblem::of_model(&problem).unwrap(),
        harmonics: Some(20),
    };
    let exact = depths(&problem, rpm, depth_mm);
    let found = method.line(rpm, depth_mm, 40).unwrap().switches;
    assert_eq!(found.len(), exact.len());
    for (found, exact) in found.iter().zip(&exact) {
        // Tolerance: truncation error with 20 harmonics.
        assert!(
            (found.depth_mm - exact.0).abs() < 2e-5 * exact.0,
            "{found:?} {exact:?}"
        );
    }
}

proptest! {
    #![proptest_config(config(12))]

    /// Receptances alone give the limits of the period map, and the number of unstable roots is that of multipliers
    /// outside the unit circle.
    #[test]
    fn methods_by_receptances_agree_with_the_default_on_random_machines(machine in machines(), share in 0.05..0.95_f64) {
        let (problem, rpm, depth_mm) = (machine.problem(), machine.rpm(), machine.depth_mm());
        let frequency = FrequencyProblem::of_model(&problem).unwrap();
        let exact = depths(&problem, rpm, depth_mm);
        let multi = MultiFrequency { problem: frequency.clone(), harmonics: None };
        let found: Vec<_> = multi
            .line(rpm, depth_mm, 40)
            .unwrap()
            .switches
            .iter()
            .map(|switch| (switch.depth_mm, switch.kind, switch.gain))
            .collect();
        // Limits with doubled harmonics change by less than 1e-4, so that their error is a third of that.
        prop_assert!(same(&found, 1.0, &exact, depth_mm, 1e-4), "{found:?} {exact:?}");

        let nyquist = Nyquist { problem: frequency.clone(), harmonics: 20 };
        let depth = share * depth_mm;
        // Closer than 1 % to a limit the truncation of harmonics may decide the count.
        prop_assume!(exact.iter().all(|switch| (switch.0 / depth - 1.0).abs() > 1e-2));
        let outside: i32 = exact
            .iter()
            .filter(|switch| switch.0 < depth)
            .map(|switch| if switch.2 { -switch.1.count() } else { switch.1.count() })
            .sum();
        prop_assert_eq!(nyquist.unstable_roots(rpm, depth).unwrap(), outside);

        // ZOA and the Nyquist criterion with averaged coefficients solve the same equations: their limits and roots
        // must agree.
        let zoa = Zoa { problem: frequency.clone() }.line(rpm, depth_mm, 40).unwrap();
        let averaged = Nyquist { problem: frequency, harmonics: 0 };
        let loci = averaged.line(rpm, depth_mm, 40).unwrap();
        prop_assert_eq!(zoa.switches.len(), loci.switches.len());
        for (p, q) in zoa.switches.iter().zip(&loci.switches) {
            prop_assert!((p.depth_mm - q.depth_mm).abs() < 1e-8 * q.depth_mm && p.gain == q.gain);
        }
        let point = averaged.point(rpm, depth).unwrap();
        let unstable = averaged.unstable_roots(rpm, depth).unwrap();
        prop_assert_eq!(unstable > 0, point.multiplier_abs > 1.0, "{:?}", point);
        prop_assert!(point.multiplier.is_finite() && Complex64::from(point.error).re < 1e-3 * point.multiplier_abs.max(1.0));
    }
}
