//! Tests of plans: the stated intervals against random machines that are measured and fitted, and the search against all sets of
//! tests.

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::*;
use quietcut_model::structure::FirstOrder;
use quietcut_simulate::STANDARD_GRAVITY;
use quietcut_stability::{Plane, Variable};
use quietcut_testkit::case;
use quietcut_testkit::rates::assert_share;

fn request(speeds_rpm: &[f64], depth_mm: f64, width: f64) -> Request {
    Request {
        speeds_rpm: speeds_rpm.to_vec(),
        listed_rpm: Vec::new(),
        depth_mm,
        samples: 40,
        width,
        prior: Prior {
            frequency: 0.01,
            damping: 0.1,
            stiffness: 0.1,
            force: 0.1,
        },
        means: Means::default(),
        linear: false,
    }
}

fn shifted(case: &Case, variables: &[Variable], by: &[f64]) -> Case {
    let mut moved = case.clone();
    for (variable, by) in variables.iter().zip(by) {
        assert!(variable.shift(&mut moved, *by));
    }
    moved
}

fn first_limit(case: &Case, rpm: f64, depth_mm: f64) -> SpeedLine {
    let problem = Problem::new(case, CubicTerms::Refuse).unwrap();
    line(&problem, rpm, depth_mm, 40).unwrap()
}

/// Rows of the matrix with these columns.
fn rows(columns: &[Vec<f64>]) -> Vec<DVector<f64>> {
    let matrix = DMatrix::from_fn(columns[0].len(), columns.len(), |row, column| {
        columns[column][row]
    });
    matrix.row_iter().map(|row| row.transpose()).collect()
}

/// Oracle of a plan: computes all measured values of its tests for a given machine, each in units of its noise.
struct Campaign<'a> {
    case: &'a Case,
    unknowns: &'a Unknowns,
    request: &'a Request,
    tests: &'a [Step],
}

impl Campaign<'_> {
    fn machine(&self, u: &DVector<f64>) -> Case {
        shifted(self.case, &self.unknowns.variables, u.as_slice())
    }

    /// All measured values without noise, their derivatives by the unknowns, and the indices of the bracketed limits among them.
    fn measured(&self, u: &DVector<f64>) -> (DVector<f64>, DMatrix<f64>, Vec<usize>) {
        let (mut values, mut slopes): (Vec<f64>, Vec<DVector<f64>>) = (Vec::new(), Vec::new());
        let mut brackets = Vec::new();
        for step in self.tests {
            match &step.test {
                Test::Cuts { rpm, bracket_mm, .. } => {
                    let limit = self.limit(u, *rpm);
                    let scale = 12.0_f64.sqrt() / bracket_mm;
                    brackets.push(values.len());
                    values.push(limit.depth_mm * scale);
                    slopes.push(&limit.gradient * scale);
                    if let Some((hz, gradient)) = &limit.chatter_hz {
                        let scale = 1.0 / (self.request.means.chatter_frequency * hz);
                        // Logarithm of the chatter frequency over its relative standard deviation.
                        values.push(hz.ln() / self.request.means.chatter_frequency);
                        slopes.push(gradient * scale);
                    }
                }
                Test::Hammer { direction, .. } => {
                    let axis = ["x", "y", "z"].iter().position(|name| name == direction).unwrap();
                    self.hammer(u, axis, &mut values, &mut slopes);
                }
                Test::Force { rpm: _, depth_mm, .. } => self.force(u, *depth_mm, &mut values, &mut slopes),
            }
        }
        let size = u.len();
        let matrix = DMatrix::from_fn(slopes.len(), size, |i, j| {
            slopes[i].get(j).copied().unwrap_or(0.0)
        });
        (DVector::from_vec(values), matrix, brackets)
    }

    fn limit(&self, u: &DVector<f64>, rpm: f64) -> Plane {
        let machine = self.machine(u);
        let line = first_limit(&machine, rpm, 2.0 * self.request.depth_mm);
        let linearized = Linearized::new(&machine, &self.unknowns.variables).unwrap();
        linearized.planes(&line).remove(0).unwrap()
    }

    /// Transform of the acceleration at the frequencies of a record of 12 s, in units of the transform of its noise.
    fn hammer(&self, u: &DVector<f64>, axis: usize, values: &mut Vec<f64>, slopes: &mut Vec<DVector<f64>>) {
        let means = &self.request.means;
        let inside = self.unknowns.variables.len();
        let structure = |u: &DVector<f64>| -> FirstOrder {
            let standing = shifted(
                &self.machine(u),
                &self.unknowns.standstill,
                &u.as_slice()[inside..],
            );
            standing.structure.unwrap().first_order().unwrap()
        };
        const SECONDS: f64 = 12.0;
        let spectrum = |u: &DVector<f64>| -> Vec<Complex64> {
            let structure = structure(u);
            let gain = 1.0 + means.calibration * u[u.len() - 2];
            let highest_hz = 2.0 * 18.48;
            let pulse_s = 0.75 / highest_hz;
            let noise = means.accelerometer_g_per_root_hertz * STANDARD_GRAVITY;
            let mut all = Vec::new();
            for bin in (8.495 * SECONDS) as usize..(highest_hz * SECONDS) as usize {
                let hz = bin as f64 / SECONDS;
                let omega = 2.0 * PI * hz;
                // Transform of the half-sine force, ∫₀^T F sin(πt/T) e^{−iωt} dt, with the phase of the middle of the impact.
                let b = PI / pulse_s;
                let force = means.peak_n * 2.0 * b * (0.5 * omega * pulse_s).cos() / (b * b - omega * omega);
                // In a record of length T, white noise of one-sided density S gives each part of a line the variance S T/4.
                let deviation = noise * (0.25 * SECONDS / means.impacts as f64).sqrt();
                let h = structure.receptance(omega).unwrap();
                for output in 0..3 {
                    all.push(h[(output, axis)] * (gain * omega * omega * force / deviation));
                }
            }
            all
        };
        let both = |all: Vec<Complex64>| -> Vec<f64> { all.iter().flat_map(|z| [z.re, z.im]).collect() };
        values.extend(both(spectrum(u)));
        let columns: Vec<Vec<f64>> = (0..u.len())
            .map(|index| {
                let at = |by: f64| {
                    let mut moved = u.clone();
                    moved[index] += by;
                    both(spectrum(&moved))
                };
                let (low, high) = (at(-0.02), at(0.02));
                low.iter()
                    .zip(&high)
                    .map(|(low, high)| (high - low) / 0.04)
                    .collect()
            })
            .collect();
        slopes.extend(rows(&columns));
    }

    /// Forces at 360 angles of a revolution, computed tooth by tooth.
    fn force(&self, u: &DVector<f64>, depth_mm: f64, values: &mut Vec<f64>, slopes: &mut Vec<DVector<f64>>) {
        let means = &self.request.means;
        let forces = |u: &DVector<f64>| -> Vec<f64> {
            let machine = self.machine(u);
            let (material, cut) = (machine.material.unwrap(), machine.cut.unwrap());
            let gain = 1.0 + means.calibration * u[u.len() - 1];
            let teeth = machine.tool.unwrap().teeth;
            let scale = gain * (2.0 * means.seconds / 360.0).sqrt() / means.dynamometer_n_per_root_hertz;
            let mut all = vec![0.0; 3 * 360];
            for index in 0..360 {
                for tooth in 0..teeth {
                    let deg = (index as f64 + 0.5 + 360.0 * tooth as f64 / teeth as f64) % 360.0;
                    if deg < cut.start_deg || deg > cut.exit_deg {
                        continue;
                    }
                    let (sin, cos) = deg.to_radians().sin_cos();
                    // Edge angle 90°: chip thickness f sin φ; tangential force against the rotation, radial force inward, axial
                    // force along the tool.
                    let area = depth_mm * cut.feed_per_tooth_mm * sin;
                    let [tangential, radial, axial] = [material.ktc_mpa, material.krc_mpa, material.kac_mpa]
                        .map(|coefficient| coefficient * area);
                    all[3 * index] += scale * (-tangential * cos - radial * sin);
                    all[3 * index + 1] += scale * (tangential * sin - radial * cos);
                    all[3 * index + 2] -= scale * axial;
                }
            }
            all
        };
        let now = forces(u);
        let columns: Vec<Vec<f64>> = (0..u.len())
            .map(|index| {
                let at = |by: f64| {
                    let mut moved = u.clone();
                    moved[index] += by;
                    forces(&moved)
                };
                at(0.5)
                    .iter()
                    .zip(&at(-0.5))
                    .map(|(high, low)| high - low)
                    .collect()
            })
            .collect();
        slopes.extend(rows(&columns));
        values.extend(now);
    }

    /// Errors of the limits of one random machine: it is drawn, its tests get noise, and its most probable parameters are fitted.
    /// Each error is divided by the half-width that the plan states.
    fn errors(&self, plan: &Plan, seed: u64, stream: u64) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(stream);
        let size = self.unknowns.len();
        let truth = DVector::from_fn(size, |_, _| StandardNormal.sample(&mut rng));
        let (mut seen, _, brackets) = self.measured(&truth);
        for (row, value) in seen.iter_mut().enumerate() {
            // A bracket contains the limit at a uniformly random position; all other values have normal noise.
            *value += if brackets.contains(&row) {
                12.0_f64.sqrt() * (rng.random::<f64>() - 0.5)
            } else {
                StandardNormal.sample(&mut rng)
            };
        }
        // Gauss–Newton starts at the true parameters: from farther away, where the resonance peaks of two receptances hardly
        // overlap, full steps converge to other minima.
        let mut u = truth.clone();
        for _ in 0..12 {
            let (values, slopes, _) = self.measured(&u);
            let information = DMatrix::identity(size, size) + slopes.tr_mul(&slopes);
            let gradient = slopes.tr_mul(&(&seen - values)) - &u;
            let step = information.cholesky().unwrap().solve(&gradient);
            u += &step;
            // Norm of the step in units of the prior standard deviations.
            if step.norm() < 1e-4 {
                break;
            }
        }
        let (machine, found) = (self.machine(&truth), self.machine(&u));
        plan.chart
            .iter()
            .map(|speed| {
                let limit = |case: &Case| {
                    first_limit(case, speed.rpm, 2.0 * self.request.depth_mm)
                        .first_limit
                        .unwrap()
                        .depth_mm
                };
                let half = 0.5 * (speed.after_mm[1] - speed.after_mm[0]);
                (limit(&machine) - limit(&found)) / half
            })
            .collect()
    }
}

/// The plan for these speeds, and the errors of its limits for `draws` machines, divided by the stated half-widths.
fn campaign(speeds_rpm: &[f64], width: f64, draws: u64) -> (Plan, Vec<f64>) {
    let seed = 20;
    println!("seed {seed}");
    let case = case("kuka-kr90-acetal");
    let request = request(speeds_rpm, 8.0, width);
    let plan = plan(&case, &request, || {}).unwrap();
    for step in &plan.tests {
        println!("{step:?}");
    }
    let unknowns = Unknowns::new(&case, &request.prior, &request.means).unwrap();
    let campaign = Campaign {
        case: &case,
        unknowns: &unknowns,
        request: &request,
        tests: &plan.tests,
    };
    let errors: Vec<Vec<f64>> = (0..draws)
        .into_par_iter()
        .map(|draw| campaign.errors(&plan, seed, draw))
        .collect();
    (plan, errors.concat())
}

/// Share of the limits inside their stated 90 % intervals, and the standard deviation of the errors over the stated one.
fn shares(errors: &[f64]) -> [f64; 2] {
    let inside = errors.iter().filter(|error| error.abs() <= 1.0).count() as f64 / errors.len() as f64;
    // Standard deviation of the errors over the stated one, which is the half-width divided by 1.645.
    let ratio =
        1.644_853_6 * (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt();
    println!("{inside:.3} of the limits inside, deviation {ratio:.3} times the promised one");
    [inside, ratio]
}

/// Checks the limits at each speed, whose errors are independent from machine to machine, and those at all speeds together.
fn check(errors: &[f64], [inside, ratio]: [f64; 2], speeds_rpm: &[f64], draws: u64) {
    for (index, rpm) in speeds_rpm.iter().enumerate() {
        let of_speed = errors.iter().skip(index).step_by(speeds_rpm.len());
        let hits = of_speed.filter(|error| error.abs() <= 1.0).count();
        assert_share(&format!("limit at {rpm} rev/min"), 0.9, hits, draws as usize);
    }
    // The errors of one machine are correlated: they count as one. The tolerance is three standard deviations of a share, and of a
    // standard deviation.
    let n = draws as f64;
    assert!((inside - 0.9).abs() < 3.0 * (0.09 / n).sqrt(), "{inside}");
    assert!((ratio - 1.0).abs() < 3.0 / (2.0 * n).sqrt(), "{ratio}");
}

#[test]
fn planned_intervals_cover_the_limits_of_a_few_machines() {
    let speeds = [800.0, 1200.0, 1700.0];
    let (plan, errors) = campaign(&speeds, 0.12, 16);
    assert!(plan.reached && !plan.tests.is_empty());
    check(&errors, shares(&errors), &speeds, 16);
}

/// Run with `cargo test --release -p quietcut-identify --lib plan -- --ignored --nocapture`.
#[test]
#[ignore = "takes minutes: 400 machines"]
fn planned_intervals_cover_the_limits_of_many_machines() {
    let speeds: Vec<f64> = (0..8).map(|i| 800.0 + 150.0 * f64::from(i)).collect();
    let (_, errors) = campaign(&speeds, 0.12, 400);
    let found = shares(&errors);
    quietcut_testkit::results::Campaign {
        name: "plan",
        title: "Limits after the tests of a plan",
        command: "cargo test --release -p quietcut-identify --lib plan -- --ignored --nocapture",
        seeds: "20; 400 machines",
    }
    .record(&[
        (
            "90 % intervals of limits that hold the truth".to_owned(),
            format!("{:.1} %", 100.0 * found[0]),
        ),
        (
            "standard deviation of the errors over the stated one".to_owned(),
            format!("{:.3}", found[1]),
        ),
    ]);
    check(&errors, found, &speeds, 400);
}

/// Cost of the cheapest of all sets of up to three different tests that reach the width.
fn cheapest_of_all(selection: &Selection<'_>, count: usize) -> Option<usize> {
    let none = count;
    let sets = (0..=count).flat_map(|a| (a..=count).flat_map(move |b| (b..=count).map(move |c| [a, b, c])));
    let is_different =
        |set: &[usize; 3]| (0..3).all(|index| set[index] == none || !set[index + 1..].contains(&set[index]));
    sets.filter(is_different)
        .filter_map(|set| {
            // Tests that inform about all limits come first: then brackets cost least.
            let mut order: Vec<usize> = set.into_iter().filter(|&index| index != none).collect();
            order.sort_by_key(|&index| selection.is_bracket(index));
            let priced = selection.priced(order);
            selection
                .is_reached(&selection.information(&priced))
                .then(|| priced.iter().map(|one| one.cost).sum())
        })
        .min()
}

#[test]
fn no_set_of_up_to_three_tests_is_cheaper() {
    let case = case("kuka-kr90-acetal");
    let speeds: Vec<f64> = (0..8).map(|i| 750.0 + 170.0 * f64::from(i)).collect();
    for width in [0.09, 0.12, 0.15, 0.2, 0.3] {
        let request = request(&speeds, 8.0, width);
        let basis = Basis::new(&case, &request, || {}).unwrap();
        let selection = Selection::new(&basis.chart, &basis.candidates, width);
        let found = selection.fewest();
        let total: usize = found.iter().map(|one| one.cost).sum();
        let reached = selection.is_reached(&selection.information(&found));
        let best = cheapest_of_all(&selection, basis.candidates.len());
        println!("{width}: {total} {reached}, best of all sets of three {best:?}");
        let mut tests: Vec<usize> = found.iter().map(|one| one.candidate).collect();
        tests.sort_unstable();
        tests.dedup();
        assert_eq!(tests.len(), found.len(), "a test is planned twice: {found:?}");
        if let Some(best) = best {
            assert!(reached && total <= best, "{width}: {total} {best}");
        }
    }
}

#[test]
fn a_change_of_one_mode_of_matrices_leaves_the_other_modes() {
    for name in ["kuka-kr90-half", "staubli-tx200"] {
        let case = case(name);
        let prior = Prior {
            frequency: 1e-4,
            damping: 1e-3,
            stiffness: 1e-3,
            force: 1e-3,
        };
        let unknowns = Unknowns::new(&case, &prior, &Means::default()).unwrap();
        let poles = |case: &Case| -> Vec<Complex64> {
            let mut poles = case.structure.as_ref().unwrap().first_order().unwrap().poles();
            poles.retain(|pole| pole.im > 0.0);
            poles
        };
        let before = poles(&case);
        let modes = before.len();
        for mode in 0..modes {
            let of = |index: usize| {
                poles(&shifted(
                    &case,
                    &unknowns.variables[3 * mode + index..][..1],
                    &[1.0],
                ))
            };
            let [by_frequency, by_damping, by_stiffness] = [0, 1, 2].map(of);
            for (index, pole) in before.iter().enumerate() {
                let moved = if index == mode { 1e-4 } else { 0.0 };
                let relative = |after: &Complex64| after.norm() / pole.norm() - 1.0;
                // Damping that couples modes and unsymmetric parts are not modelled by the modes of M and K: at most a tenth of a
                // change affects another mode.
                assert!(
                    (relative(&by_frequency[index]) - moved).abs() < 1e-5,
                    "{name} {mode} {index}"
                );
                let damping = |pole: &Complex64| -pole.re / pole.norm();
                let of_damping = damping(&by_damping[index]) / damping(pole) - 1.0;
                let moved = if index == mode { 1e-3 } else { 0.0 };
                assert!(
                    (of_damping - moved).abs() < 3e-4,
                    "{name} {mode} {index} {of_damping}"
                );
                assert!(
                    (by_stiffness[index] - pole).norm() < 1e-4 * pole.norm(),
                    "{name} {mode} {index}"
                );
            }
        }
    }
}

#[test]
fn the_lowest_of_several_lobes_is_distributed_as_draws_are() {
    let plane = |depth_mm: f64, gradient: &[f64]| Plane {
        depth_mm,
        gradient: DVector::from_column_slice(gradient),
        chatter_hz: None,
    };
    let limit = KnownLimit {
        rpm: 1000.0,
        planes: vec![
            plane(2.0, &[0.3, 0.1, 0.0]),
            plane(2.1, &[-0.4, 0.2, 0.1]),
            plane(2.3, &[0.0, 0.0, 0.5]),
        ],
    };
    let chart = KnownChart::new(vec![limit.clone()]);
    let information = DMatrix::from_row_slice(3, 3, &[2.0, 0.5, 0.0, 0.5, 1.5, 0.2, 0.0, 0.2, 1.0]);
    let [from, to] = chart.intervals(&information)[0];
    let root = information.clone().try_inverse().unwrap().cholesky().unwrap().l();
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut lowest: Vec<f64> = (0..200_000)
        .map(|_| {
            let u = &root * DVector::from_fn(3, |_, _| StandardNormal.sample(&mut rng));
            let depths = limit
                .planes
                .iter()
                .map(|plane| plane.depth_mm + plane.gradient.dot(&u));
            depths.fold(f64::INFINITY, f64::min)
        })
        .collect();
    lowest.sort_by(f64::total_cmp);
    let (five, ninety_five) = (lowest[10_000], lowest[190_000]);
    println!("{from} {five}, {to} {ninety_five}");
    // 256 points in three dimensions determine the ends of the interval to a twentieth of its width.
    let near = 0.05 * (ninety_five - five);
    assert!((from - five).abs() < near && (to - ninety_five).abs() < near);
}

#[test]
fn an_unknown_whose_change_gives_no_valid_machine_is_named() {
    let case = case("kuka-kr90-acetal");
    let mut request = request(&[1200.0], 8.0, 0.1);
    // A twentieth of this deviation is more than the damping ratio itself.
    request.means.standstill_damping = 25.0;
    let error = plan(&case, &request, || {}).unwrap_err().to_string();
    assert!(
        error.contains("damping ratio of") && error.contains("at standstill"),
        "{error}"
    );
}

#[test]
fn lobes_without_derivatives_are_listed_with_the_reasons() {
    let case = case("kuka-kr90-acetal");
    let (line, linearized) = (0..40)
        .map(|step| first_limit(&case, 600.0 + 20.0 * f64::from(step), 12.0))
        .find(|line| line.switches.iter().filter(|switch| !switch.gain).count() >= 2)
        .map(|line| {
            let unknowns = Unknowns::new(&case, &Prior::default(), &Means::default()).unwrap();
            (line, Linearized::new(&case, &unknowns.variables).unwrap())
        })
        .unwrap();
    let (limit, missing) = KnownLimit::new(&line, &linearized, 20);
    assert!(limit.unwrap().planes.len() >= 2 && missing.is_empty());
    // A linear structure has no fold, hence no Floquet mode and no derivative of one.
    let losses: Vec<usize> = (0..line.switches.len())
        .filter(|index| !line.switches[*index].gain)
        .collect();
    let without = |loss: usize| {
        let mut line = line.clone();
        line.switches[losses[loss]].kind = quietcut_stability::StabilityLoss::Fold;
        KnownLimit::new(&line, &linearized, 20)
    };
    let (limit, missing) = without(1);
    let depth_mm = line.switches[losses[1]].depth_mm;
    assert!(
        limit
            .unwrap()
            .planes
            .iter()
            .all(|plane| plane.depth_mm != depth_mm)
    );
    assert_eq!(
        (missing.len(), missing[0].depth_mm, missing[0].is_first),
        (1, depth_mm, false)
    );
    assert!(
        missing[0].reason.contains("no motion belongs to this limit"),
        "{missing:?}"
    );
    // Without the derivatives of the first limit the speed is left out, and a chart of such speeds is refused for that
    // reason and not for want of a limit.
    let (limit, missing) = without(0);
    assert!(limit.is_none() && missing[0].is_first);
    let request = request(&[line.rpm], 12.0, 0.1);
    let error = no_known_limit(&case, &request, &missing).to_string();
    assert!(
        error.contains("no derivatives") && error.contains("no motion belongs"),
        "{error}"
    );
    let error = no_known_limit(&case, &request, &[]).to_string();
    assert!(error.contains("at none of the 1 speeds"), "{error}");
}
