//! Cuts compared with a second, independent integration: small fixed steps of the classical Runge–Kutta method, and surfaces on a
//! grid of spindle angles. It shares only the case with the simulation.

use num_complex::Complex64;

use super::*;
use quietcut_model::milling::Runout;
use quietcut_model::structure::{Form, Structure};

/// A cut on a grid of `points` spindle angles per revolution: two per step, because the surface is required in the middle of a step too.
struct Brute<'a> {
    case: &'a Case,
    spindle_rpm: f64,
    depth_mm: f64,
    points: usize,
    /// Position of each tooth on the tool, in grid points, and its radius minus the mean radius, m.
    teeth: Vec<(usize, f64)>,
    process: Process,
}

/// Parameters of chip law, process damping, wear and speed modulation, whose equations are written here a second time.
#[derive(Clone, Copy)]
struct Process {
    exponent: f64,
    reference_m: f64,
    damping_n_per_m: f64,
    friction: f64,
    wear_per_s: f64,
    delta: f64,
    fluctuation_hz: f64,
    psi: f64,
}

const PLAIN: Process = Process {
    exponent: 1.0,
    reference_m: 1.0,
    damping_n_per_m: 0.0,
    friction: 0.0,
    wear_per_s: 0.0,
    delta: 0.0,
    fluctuation_hz: 1.0,
    psi: 0.0,
};

enum Equations {
    Second {
        inverse_mass: nalgebra::DMatrix<f64>,
        matrices: Box<quietcut_model::structure::Matrices>,
        axes: Vec<Option<usize>>,
    },
    Modes(Vec<(Complex64, [Complex64; 3], [Complex64; 3])>),
}

impl Equations {
    fn new(structure: &Structure) -> Self {
        match &structure.form {
            Form::Matrices(matrices) => Self::Second {
                inverse_mass: matrices.mass.clone().try_inverse().unwrap(),
                matrices: Box::new(matrices.clone()),
                axes: structure
                    .directions
                    .iter()
                    .map(|direction| direction.axis())
                    .collect(),
            },
            Form::Joints(_) => unreachable!("no case of these tests has joints"),
            Form::Modes(modes) => Self::Modes(
                modes
                    .iter()
                    .map(|mode| {
                        let omega = std::f64::consts::TAU * mode.frequency_hz;
                        let zeta = mode.damping_ratio;
                        let pole = Complex64::new(-zeta * omega, omega * (1.0 - zeta * zeta).sqrt());
                        (
                            pole,
                            std::array::from_fn(|axis| mode.left[axis]),
                            std::array::from_fn(|axis| mode.right[axis]),
                        )
                    })
                    .collect(),
            ),
        }
    }

    fn order(&self) -> usize {
        match self {
            Self::Second { axes, .. } => 2 * axes.len(),
            Self::Modes(modes) => modes.len(),
        }
    }

    fn displacement(&self, y: &[Complex64]) -> [f64; 3] {
        let mut x = [0.0; 3];
        match self {
            Self::Second { axes, .. } => {
                for (axis, y) in axes.iter().zip(y) {
                    if let Some(axis) = axis {
                        x[*axis] = y.re;
                    }
                }
            }
            Self::Modes(modes) => {
                for ((_, _, right), y) in modes.iter().zip(y) {
                    for axis in 0..3 {
                        x[axis] += 2.0 * (right[axis] * y).re;
                    }
                }
            }
        }
        x
    }

    /// Velocity of the tool, m/s: the displacement is linear in y, so that its rate is the displacement of ẏ.
    fn velocity(&self, y: &[Complex64], force: [f64; 3]) -> [f64; 3] {
        self.displacement(&self.rate(y, force))
    }

    fn rate(&self, y: &[Complex64], force: [f64; 3]) -> Vec<Complex64> {
        match self {
            Self::Second {
                inverse_mass,
                matrices,
                axes,
            } => {
                let n = axes.len();
                let q = nalgebra::DVector::from_fn(n, |i, _| y[i].re);
                let v = nalgebra::DVector::from_fn(n, |i, _| y[n + i].re);
                let mut f = nalgebra::DVector::from_fn(n, |i, _| axes[i].map_or(0.0, |axis| force[axis]));
                f -= &matrices.damping * &v + &matrices.stiffness * &q;
                if let Some(cubic) = &matrices.cubic_damping {
                    f -= cubic * v.map(|v| v.powi(3));
                }
                if let Some(cubic) = &matrices.cubic_stiffness {
                    f -= cubic * q.map(|q| q.powi(3));
                }
                let a = inverse_mass * f;
                v.iter()
                    .chain(a.iter())
                    .map(|x| Complex64::new(*x, 0.0))
                    .collect()
            }
            Self::Modes(modes) => modes
                .iter()
                .zip(y)
                .map(|((pole, left, _), y)| {
                    pole * y + left.iter().zip(force).map(|(l, f)| l * f).sum::<Complex64>()
                })
                .collect(),
        }
    }
}

/// Times, s, at which the spindle passed each grid point so far.
struct Times(Vec<f64>);

impl Brute<'_> {
    /// Displacement of the tool, m, at every second grid point over `turns` revolutions.
    fn run(&self, turns: usize) -> Vec<[f64; 3]> {
        let equations = Equations::new(self.case.structure().unwrap());
        let step_s = 2.0 * 60.0 / self.spindle_rpm / self.points as f64;
        let mut y = vec![Complex64::ZERO; equations.order()];
        // Height of the surface that each tooth left, by grid point. Before the start, a tool at rest left the surface.
        let mut surface: Vec<Vec<f64>> = vec![Vec::new(); self.teeth.len()];
        let mut found = Vec::new();
        let mut x = equations.displacement(&y);
        // The independent variable is the spindle angle, expressed as the time at the mean speed. The true time is the last state of y.
        y.push(Complex64::ZERO);
        let slowness = |t: f64| {
            let Process {
                delta,
                fluctuation_hz,
                psi,
                ..
            } = self.process;
            1.0 / (1.0 + delta * (std::f64::consts::TAU * fluctuation_hz * t + psi).sin())
        };
        let mut times = Times(vec![0.0]);
        self.leave(&mut surface, &times, 0, x);
        found.push(x);
        let stage = |y: &[Complex64], k: &[Complex64], h: f64| -> Vec<Complex64> {
            y.iter().zip(k).map(|(y, k)| y + h * k).collect()
        };
        for point in (0..turns * self.points).step_by(2) {
            let rate = |surface: &[Vec<f64>], y: &[Complex64], point: usize, side: f64| {
                let (t, y) = (y[y.len() - 1].re, &y[..y.len() - 1]);
                let x = equations.displacement(y);
                let mut force = self.force(surface, &times, (point, side, t), (x, [0.0; 3]));
                if self.process.damping_n_per_m != 0.0 {
                    // Force and velocity may depend on each other: a fixed-point iteration of six rounds.
                    for _ in 0..6 {
                        let v = equations.velocity(y, force);
                        force = self.force(surface, &times, (point, side, t), (x, v));
                    }
                }
                let mut rate = equations.rate(y, force);
                rate.push(Complex64::ONE);
                rate.iter().map(|rate| rate * slowness(t)).collect::<Vec<_>>()
            };
            let k1 = rate(&surface, &y, point, 0.5);
            let k2 = rate(&surface, &stage(&y, &k1, 0.5 * step_s), point + 1, 0.0);
            let k3 = rate(&surface, &stage(&y, &k2, 0.5 * step_s), point + 1, 0.0);
            let k4 = rate(&surface, &stage(&y, &k3, step_s), point + 2, -0.5);
            let end: Vec<Complex64> = (0..y.len())
                .map(|i| y[i] + step_s / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
                .collect();
            // States in the middle of the step, from Hermite's cubic interpolation.
            let middle: Vec<Complex64> = (0..y.len())
                .map(|i| 0.5 * (y[i] + end[i]) + step_s / 8.0 * (k1[i] - k4[i]))
                .collect();
            y = end;
            let last = y.len() - 1;
            times.0.extend([middle[last].re, y[last].re]);
            self.leave(
                &mut surface,
                &times,
                point + 1,
                equations.displacement(&middle[..last]),
            );
            x = equations.displacement(&y[..last]);
            self.leave(&mut surface, &times, point + 2, x);
            found.push(x);
        }
        found
    }

    fn phi_deg(&self, tooth: usize, point: usize, side: f64) -> f64 {
        let at = (point + self.teeth[tooth].0) % self.points;
        (360.0 * (at as f64 + side) / self.points as f64).rem_euclid(360.0)
    }

    fn reach(&self, tooth: usize, phi_deg: f64, x: [f64; 3]) -> f64 {
        let gamma = self.case.tool().unwrap().edge_angle_deg.to_radians();
        let feed = self.case.cut().unwrap().feed_direction_deg.to_radians();
        let (along, across) = (
            x[0] * feed.cos() + x[1] * feed.sin(),
            x[1] * feed.cos() - x[0] * feed.sin(),
        );
        let phi = phi_deg.to_radians();
        (along * phi.sin() + across * phi.cos() + self.teeth[tooth].1) * gamma.sin() - x[2] * gamma.cos()
    }

    /// Height of the surface in front of a tooth at a grid point, m.
    fn in_front(&self, surface: &[Vec<f64>], times: &Times, tooth: usize, point: usize, phi_deg: f64) -> f64 {
        let ahead = (tooth + 1) % self.teeth.len();
        let gap = (self.points + self.teeth[ahead].0 - self.teeth[tooth].0) % self.points;
        let gap = if gap == 0 { self.points } else { gap };
        let left = if point < gap {
            self.reach(ahead, phi_deg, [0.0; 3])
        } else {
            surface[ahead][point - gap]
        };
        let turn_feed_m = 1e-3 * self.case.cut().unwrap().feed_per_tooth_mm * self.teeth.len() as f64;
        let gamma = self.case.tool().unwrap().edge_angle_deg.to_radians();
        let turns = if self.process.delta == 0.0 {
            gap as f64 / self.points as f64
        } else {
            (self.time(times, point as f64) - self.time(times, point as f64 - gap as f64)) * self.spindle_rpm
                / 60.0
        };
        left - turn_feed_m * turns * phi_deg.to_radians().sin() * gamma.sin()
    }

    /// Time at which the spindle passed a grid point, s; for points before the start by bisection of the spindle angle.
    fn time(&self, times: &Times, point: f64) -> f64 {
        if point >= 0.0
            && let Some(time) = times.0.get(point as usize)
        {
            return *time;
        }
        let Process {
            delta,
            fluctuation_hz,
            psi,
            ..
        } = self.process;
        let omega = std::f64::consts::TAU * fluctuation_hz;
        let wanted = point / self.points as f64 * 60.0 / self.spindle_rpm;
        let turned = |t: f64| t + delta / omega * (psi.cos() - (omega * t + psi).cos());
        let (mut low, mut high) = (wanted - 2.0 / omega, wanted + 2.0 / omega);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if turned(middle) > wanted {
                high = middle
            } else {
                low = middle
            }
        }
        low
    }

    fn leave(&self, surface: &mut [Vec<f64>], times: &Times, point: usize, x: [f64; 3]) {
        let heights: Vec<f64> = (0..self.teeth.len())
            .map(|tooth| {
                let phi_deg = self.phi_deg(tooth, point, 0.0);
                self.reach(tooth, phi_deg, x)
                    .max(self.in_front(surface, times, tooth, point, phi_deg))
            })
            .collect();
        for (surface, height) in surface.iter_mut().zip(heights) {
            surface.push(height);
        }
    }

    /// Force on the tool at a grid point, N. `side` decides on which side of the point entry and exit are evaluated.
    fn force(
        &self,
        surface: &[Vec<f64>],
        times: &Times,
        (point, side, t): (usize, f64, f64),
        (x, v): ([f64; 3], [f64; 3]),
    ) -> [f64; 3] {
        let (tool, material, cut) = (
            self.case.tool().unwrap(),
            self.case.material().unwrap(),
            self.case.cut().unwrap(),
        );
        let gamma = tool.edge_angle_deg.to_radians();
        let mut sum = [0.0; 3];
        for tooth in 0..self.teeth.len() {
            let phi_deg = self.phi_deg(tooth, point, 0.0);
            let sided = self.phi_deg(tooth, point, side);
            let chip = self.reach(tooth, phi_deg, x) - self.in_front(surface, times, tooth, point, phi_deg);
            if !(cut.start_deg..cut.exit_deg).contains(&sided) || chip <= 0.0 {
                continue;
            }
            let modulation = if self.case.axial_depth_modulation() {
                x[2]
            } else {
                0.0
            };
            let depth_mm = self.depth_mm - 1e3 * modulation;
            let Process {
                exponent,
                reference_m,
                damping_n_per_m,
                friction,
                wear_per_s,
                delta,
                fluctuation_hz,
                psi,
            } = self.process;
            let chip = reference_m * (chip / reference_m).powf(exponent);
            let wear = 1.0 + wear_per_s * t;
            let of = |cutting: f64, edge: f64| wear * depth_mm * (cutting * 1e3 * chip + edge / gamma.sin());
            let (mut ft, mut fr, fa) = (
                of(material.ktc_mpa, material.kte_n_per_mm),
                of(material.krc_mpa, material.kre_n_per_mm),
                of(material.kac_mpa, material.kae_n_per_mm),
            );
            let (sin, cos) = phi_deg.to_radians().sin_cos();
            if damping_n_per_m != 0.0 {
                // Velocity of the edge along the chip thickness: `reach` is linear in the displacement.
                let towards = self.reach(tooth, phi_deg, v) - self.reach(tooth, phi_deg, [0.0; 3]);
                let radius_mm = 0.5 * tool.diameter_mm.unwrap();
                let speed = std::f64::consts::TAU / 60.0
                    * self.spindle_rpm
                    * (1.0 + delta * (std::f64::consts::TAU * fluctuation_hz * t + psi).sin())
                    * 1e-3
                    * radius_mm;
                let rubbing = wear * damping_n_per_m / speed * 1e-3 * depth_mm * towards;
                fr += rubbing;
                ft += friction * rubbing;
            }
            let along = -cos * ft - sin * gamma.sin() * fr - sin * gamma.cos() * fa;
            let across = sin * ft - cos * gamma.sin() * fr - cos * gamma.cos() * fa;
            let feed = cut.feed_direction_deg.to_radians();
            sum[0] += along * feed.cos() - across * feed.sin();
            sum[1] += along * feed.sin() + across * feed.cos();
            sum[2] += gamma.cos() * fr - gamma.sin() * fa;
        }
        sum
    }
}

/// Largest difference between simulation and grid over `turns` revolutions, relative to the largest displacement.
fn difference(
    case: &Case,
    spindle_rpm: f64,
    depth_mm: f64,
    runout: Runout,
    turns: usize,
    points: usize,
) -> f64 {
    let cut = (spindle_rpm, depth_mm, turns, points);
    difference_with(case, cut, runout, &[], PLAIN)
}

/// As [`difference`], with `effects` in the simulation and `process` in the independent integration.
fn difference_with(
    case: &Case,
    (spindle_rpm, depth_mm, turns, points): (f64, f64, usize, usize),
    runout: Runout,
    effects: &[&str],
    process: Process,
) -> f64 {
    let effects = Effects::parse(effects.iter().copied()).unwrap();
    let mut model = steady(case, spindle_rpm, depth_mm);
    let cutting = model.cutting.as_mut().unwrap();
    cutting.cutter = effects.cutter(cutting.cutter.clone()).unwrap();
    cutting.spindle = effects.spindle(cutting.spindle);
    let cutter = &mut cutting.cutter;
    cutter.set_runout(runout);
    let teeth = cutter
        .teeth
        .iter()
        .enumerate()
        .map(|(index, tooth)| {
            let place = tooth.angle_rad / std::f64::consts::TAU * points as f64;
            assert!(
                (place - place.round()).abs() < 1e-6,
                "tooth {index} between the points"
            );
            (place.round() as usize, tooth.radial_m)
        })
        .collect();
    let brute = Brute {
        case,
        spindle_rpm,
        depth_mm,
        points,
        teeth,
        process,
    }
    .run(turns);
    let spindle = model.cutting.as_ref().unwrap().spindle;
    let when_s = |index: usize| spindle.time_s(2.0 * std::f64::consts::TAU * index as f64 / points as f64);
    let mut motions = Vec::new();
    let mut workspace = Workspace::new(&model);
    let statistics = model
        .run(when_s(turns * points / 2 + 1), Settings::default(), |step| {
            while motions.len() <= turns * points / 2 && when_s(motions.len()) <= step.to_s() {
                motions.push(step.motion(when_s(motions.len()), &mut workspace).displacement_m);
            }
        })
        .unwrap();
    let changes = statistics.contact_changes;
    assert!(changes > 10, "no loss of contact to speak of: {changes}");
    let size = brute.iter().flatten().fold(0.0_f64, |a, b| a.max(b.abs()));
    brute
        .iter()
        .zip(&motions)
        .flat_map(|(a, b)| a.iter().zip(b).map(|(a, b)| (a - b).abs()))
        .fold(0.0, f64::max)
        / size
}

const TRUE: Runout = Runout {
    offset_um: 0.0,
    angle_deg: 0.0,
};

#[test]
fn chatter_with_loss_of_contact() {
    // Changes of contact between two points make the grid second-order; growing chatter amplifies the error. With finer grids the
    // difference falls to 1e-6.
    let acetal = difference(&case("kuka-kr90-acetal"), 900.0, 3.0, TRUE, 30, 8000);
    assert!(acetal < 1e-5, "{acetal}");
    let cubic = difference(&case("kuka-kr90-full-cubic"), 1000.0, 3.0, TRUE, 30, 8000);
    assert!(cubic < 1e-5, "{cubic}");
}

#[test]
fn edge_forces_and_a_depth_that_follows_the_vibration() {
    let mut staubli = case("staubli-tx200");
    // A start angle that lies on the grid of spindle angles.
    staubli.cut.as_mut().unwrap().start_deg = 126.0;
    // The force jumps at loss of contact, where the grid is first-order: the difference is 2e-5 with four times the points.
    let found = difference(&staubli, 500.0, 1.4, TRUE, 5, 48_000);
    assert!(found < 5e-4, "{found}");
}

#[test]
fn variable_pitch_runout_and_a_rotated_feed() {
    let mut benchmark = case("insperger-2dof-ad0.5");
    let tool = benchmark.tool.as_mut().unwrap();
    tool.teeth = 3;
    tool.pitch_deg = vec![100.0, 125.0, 135.0];
    benchmark.cut.as_mut().unwrap().feed_direction_deg = 35.0;
    let runout = Runout {
        offset_um: 30.0,
        angle_deg: 50.0,
    };
    let found = difference(&benchmark, 6000.0, 0.6, runout, 30, 7200);
    assert!(found < 1e-4, "{found}");
}

#[test]
fn a_chip_law_that_is_not_linear() {
    let process = Process {
        exponent: 0.7,
        reference_m: 0.1e-3,
        ..PLAIN
    };
    let effects = ["force-exponent=0.7", "force-exponent.reference_chip_mm=0.1"];
    let found = difference_with(
        &case("kuka-kr90-full-cubic"),
        (1000.0, 3.0, 30, 16_000),
        TRUE,
        &effects,
        process,
    );
    // The force has an infinite derivative where a chip begins: the grid is of order 1.7 there.
    assert!(found < 1e-4, "{found}");
}

#[test]
fn process_damping_with_its_friction() {
    let process = Process {
        damping_n_per_m: 2e5,
        friction: 0.3,
        ..PLAIN
    };
    let effects = ["process-damping=2e5", "process-damping.friction=0.3"];
    for (name, rpm) in [("kuka-kr90-full-cubic", 1000.0), ("kuka-kr90-acetal", 900.0)] {
        // The force jumps where contact changes: the grid is first-order there.
        let found = difference_with(&case(name), (rpm, 3.0, 10, 32_000), TRUE, &effects, process);
        assert!(found < 3e-4, "{name}: {found}");
    }
}

#[test]
fn wear_and_other_coefficients() {
    let mut worn = case("kuka-kr90-full-cubic");
    let effects = [
        "wear.relative_rate_per_s=0.3",
        "force-coefficients=0.2",
        "edge-force=4",
        "edge-force.kre_n_per_mm=3",
    ];
    let mut model = case("kuka-kr90-full-cubic");
    let material = worn.material.as_mut().unwrap();
    (material.ktc_mpa, material.krc_mpa) = (1.2 * material.ktc_mpa, 1.2 * material.krc_mpa);
    (material.kte_n_per_mm, material.kre_n_per_mm) = (4.0, 3.0);
    // The independent integration takes its coefficients from the case, the simulation from the effects.
    std::mem::swap(&mut worn, &mut model);
    let process = Process {
        wear_per_s: 0.3,
        ..PLAIN
    };
    let with_effects = ends(&worn, &effects);
    let by_case = ends(&model, &effects[..1]);
    for (a, b) in with_effects.iter().zip(&by_case) {
        assert!((a - b).abs() < 1e-9, "{a} {b}");
    }
    let found = difference_with(&model, (1000.0, 3.0, 10, 32_000), TRUE, &effects[..1], process);
    assert!(found < 5e-4, "{found}");
}

/// Displacement of the tool, m, after half a second of a cut 3 mm deep.
fn ends(case: &Case, effects: &[&str]) -> [f64; 3] {
    let effects = Effects::parse(effects.iter().copied()).unwrap();
    let mut model = steady(case, 1000.0, 3.0);
    let cutting = model.cutting.as_mut().unwrap();
    cutting.cutter = effects.cutter(cutting.cutter.clone()).unwrap();
    motions(&model, Settings::default(), 0.5, 1.0, 0.51)[0].displacement_m
}

#[test]
fn a_spindle_that_fluctuates() {
    let process = Process {
        delta: 0.1,
        fluctuation_hz: 3.0,
        psi: 0.5,
        ..PLAIN
    };
    let effects = [
        "speed-fluctuation=0.1",
        "speed-fluctuation.frequency_hz=3",
        "speed-fluctuation.phase_deg=28.64788975654116",
    ];
    for (name, rpm) in [("kuka-kr90-full-cubic", 1000.0), ("kuka-kr90-acetal", 900.0)] {
        let found = difference_with(&case(name), (rpm, 3.0, 20, 8000), TRUE, &effects, process);
        assert!(found < 1e-5, "{name}: {found}");
    }
}
