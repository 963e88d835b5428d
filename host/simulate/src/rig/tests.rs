//! Rigs and restoring forces against closed forms.

use std::f64::consts::{PI, TAU};

use super::*;
use quietcut_testkit::case;

pub(super) fn rig(signal: Signal, effects: &[&str]) -> Rig {
    Rig {
        effects: Effects::parse(effects.iter().copied()).unwrap(),
        measured: vec![Quantity::Displacement, Quantity::Velocity, Quantity::Acceleration],
        ..Rig::new(Direction::Y, signal, 500.0)
    }
}

pub(super) fn samples<'a>(recording: &'a Recording, name: &str) -> &'a [f64] {
    &recording.channel(name).unwrap().samples
}

/// The mode of chapter 5 at 17 Hz without its cubic terms: 188 kg, 305 N s/m, 2.26e6 N/m.
pub(super) fn linear() -> Structure {
    let mut structure = case("kuka-kr90-y17-low").structure.unwrap();
    if let quietcut_model::structure::Form::Matrices(matrices) = &mut structure.form {
        (matrices.cubic_damping, matrices.cubic_stiffness) = (None, None);
    }
    structure
}

#[test]
fn a_steady_tone_gives_the_receptance() {
    // 40 s are 32 time constants 2m/c of the free decay: the transient falls to e⁻³².
    let tone = Signal::tones(&[17.2], [2.0, 2.0], 42.0, 1);
    let (recording, _) = rig(tone, &[]).record(&linear(), Path::new("a.csv")).unwrap();
    let h = linear().first_order().unwrap().receptance(TAU * 17.2).unwrap()[(1, 1)];
    for k in 20_000..21_000 {
        let t = k as f64 / 500.0;
        let wanted = 2.0 * (h * num_complex::Complex64::from_polar(1.0, TAU * 17.2 * t - 0.5 * PI)).re;
        assert!((samples(&recording, "y")[k] - wanted).abs() < 1e-6 * 2.0 * h.norm());
    }
}

#[test]
fn every_smooth_restoring_force_obeys_its_equation() {
    let tones = Signal::tones(&[16.0, 17.4, 18.1], [30.0, 30.0], 3.0, 2);
    let (m, c, k) = (188.0, 305.0, 2.26e6);
    type Law = fn(f64, f64, f64) -> f64;
    let cases: [(&[&str], Law); 8] = [
        (&["cubic-stiffness=-5e12"], |x, _, _| -5e12 * x.powi(3)),
        (&["quadratic-stiffness=3e9"], |x, _, _| 3e9 * x * x),
        (&["cubic-damping=2.5e6"], |_, v, _| 2.5e6 * v.powi(3)),
        (&["quadratic-damping=2e4"], |_, v, _| 2e4 * v.abs() * v),
        (
            &[
                "softening-hardening=-5e12",
                "softening-hardening.k5_n_per_m5=4e20",
            ],
            |x, _, _| -5e12 * x.powi(3) + 4e20 * x.powi(5),
        ),
        (&["quintic-stiffness=4e20"], |x, _, _| 4e20 * x.powi(5)),
        (&["drift.relative_rate_per_s=0.02"], |x, _, t| {
            2.26e6 * 0.02 * t * x
        }),
        (&["stiffness=0.1", "damping=-0.5"], |x, v, _| {
            2.26e5 * x - 152.5 * v
        }),
    ];
    for (effects, law) in cases {
        let (recording, _) = rig(tones.clone(), effects)
            .record(&linear(), Path::new("a.csv"))
            .unwrap();
        let of = |name: &str, i: usize| samples(&recording, name)[i];
        let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
        for i in 0..recording.len() {
            let (x, v, t) = (of("y", i), of("vy", i), i as f64 / 500.0);
            let added = law(x, v, t);
            let residual = m * of("ay", i) + c * v + k * x + added - of("fy", i);
            worst = worst.max(residual.abs());
            largest = largest.max(added.abs());
        }
        // The error of the motion is 1e-8 of its amplitude, at which the spring force is 300 N.
        assert!(worst < 1e-4 && largest > 0.5, "{effects:?}: {worst} of {largest}");
    }
}

#[test]
fn the_inverse_amplitude_grows_by_the_same_in_every_cycle_of_quadratic_damping() {
    // A cycle dissipates ∮c2·|v|³ dt = (8/3)·c2·ω²·A³ of the energy ½·m·ω²·A²: d(1/A)/dn = (8/3)·c2/m, to first order in c2·A/m.
    let (m, c2) = (188.0, 2_000.0);
    let effects = ["damping=-0.99999999", "quadratic-damping=2000"];
    let release = Signal::Release {
        force_n: 500.0,
        pull_s: 3.0,
        seconds: 4.0,
    };
    let (recording, _) = Rig {
        sample_rate_hz: 20_000.0,
        ..rig(release, &effects)
    }
    .record(&linear(), Path::new("a.csv"))
    .unwrap();
    let y = &samples(&recording, "y")[(3.6 * 20_000.0) as usize..];
    // Maxima of the displacement, one per cycle.
    let tops: Vec<f64> = y
        .windows(3)
        .filter(|top| top[1] > 0.0 && top[0] < top[1] && top[1] >= top[2])
        .map(|top| top[1])
        .collect();
    assert!(tops.len() > 40 && tops[40] < 0.97 * tops[0], "{tops:?}");
    let slope = (1.0 / tops[40] - 1.0 / tops[0]) / 40.0;
    let exact = 8.0 / 3.0 * c2 / m;
    assert!(
        (slope / exact - 1.0).abs() < 3.0 * c2 * tops[0] / m,
        "{slope} {exact}"
    );
}

#[test]
fn dry_friction_reduces_the_amplitude_by_the_same_in_every_half_cycle_and_then_sticks() {
    // With friction as the only damping, the peaks decrease by 2·fc/k per half cycle until |x| k < fc.
    let effects = ["damping=-0.99999999", "coulomb-friction=20"];
    let release = Signal::Release {
        force_n: 500.0,
        pull_s: 3.0,
        seconds: 2.0,
    };
    let (recording, statistics) = Rig {
        sample_rate_hz: 20_000.0,
        ..rig(release, &effects)
    }
    .record(&linear(), Path::new("a.csv"))
    .unwrap();
    let y = samples(&recording, "y");
    let released = (3.6 * 20_000.0) as usize;
    let (k, fc) = (2.26e6, 20.0);
    let mut wanted = y[released];
    let half_swing = PI * (188.0_f64 / k).sqrt();
    let mut swings = 0;
    while wanted.abs() > fc / k {
        wanted = -(wanted - wanted.signum() * 2.0 * fc / k);
        swings += 1;
        let i = released + (f64::from(swings) * half_swing * 20_000.0).round() as usize;
        // Error by sampling at a peak: an offset of half a sampling interval lowers it by (ωdt)²/8 of its height.
        assert!(
            (y[i] - wanted).abs() < 1e-4 * y[released],
            "{swings}: {} {wanted}",
            y[i]
        );
    }
    let last = y[y.len() - 1];
    assert!((last - wanted).abs() < 1e-9 && samples(&recording, "vy")[y.len() - 1] == 0.0);
    assert!(swings > 5 && statistics.regime_changes >= swings as u64);
}

#[test]
fn stick_ends_at_the_first_peak_of_the_force_above_the_friction_force() {
    // Until slip begins, only the excitation force limits the integration step.
    let tone = Signal::tones(&[17.2], [0.0, 30.0], 20.0, 1);
    let instant = |index: u32| f64::from(index) * 1e-5;
    let wanted = (0..2_000_000)
        .map(instant)
        .find(|t| tone.force_n(*t).abs() > 20.0)
        .unwrap();
    let effects = ["coulomb-friction=20"];
    let (recording, _) = rig(tone, &effects).record(&linear(), Path::new("a.csv")).unwrap();
    let y = samples(&recording, "y");
    // First sample with a motion beyond rounding.
    let first = y.iter().position(|y| y.abs() > 1e-15).unwrap();
    // Slip is seen within one sampling interval, 2 ms, after the force exceeds friction.
    let late = first as f64 / 500.0 - wanted;
    assert!((0.0..=2e-3).contains(&late), "{late} after {wanted}");
}

#[test]
fn friction_behind_a_clearance_follows_the_law_of_hertz() {
    let effects = [
        "coulomb-friction=30",
        "coulomb-friction.fc_minus_n=20",
        "backlash=0.05",
        "backlash.contact_mm=0.02",
        "backlash.before=coulomb-friction",
    ];
    let tones = Signal::tones(&[16.0, 17.4], [150.0, 150.0], 2.0, 4);
    let (recording, _) = Rig {
        sample_rate_hz: 20_000.0,
        ..rig(tones, &effects)
    }
    .record(&linear(), Path::new("a.csv"))
    .unwrap();
    let (m, c, k) = (188.0, 305.0, 2.26e6);
    let [y, v, a, force] = ["y", "vy", "ay", "fy"].map(|name| samples(&recording, name));
    let (mut slider, mut seen) = (0.0_f64, [false; 3]);
    for i in 0..y.len() {
        slider = slider.clamp(y[i] - 45e-6, y[i] + 45e-6);
        let ahead = y[i] - slider;
        let pressed = ((ahead.abs() - 25e-6) / 20e-6).clamp(0.0, 1.0);
        let wanted = if ahead > 0.0 { 30.0 } else { -20.0 } * pressed.powf(1.5);
        seen[if pressed == 0.0 {
            0
        } else {
            1 + usize::from(pressed > 0.999)
        }] = true;
        let found = force[i] - m * a[i] - c * v[i] - k * y[i];
        // Between samples the tool may move the slider further by about 1e-6 of the motion.
        assert!((found - wanted).abs() < 0.02, "{i}: {found} {wanted}");
    }
    assert_eq!(seen, [true; 3]);
}

#[test]
fn backlash_has_the_period_of_its_closed_form() {
    // Without damping, a mass with a gap ±a and amplitude X has the period 4·(√(m/k)·(π/2) + a/(ω·(X − a))).
    let effects = ["damping=-0.99999999", "backlash=0.1"];
    let impact = Signal::Impacts {
        impacts: vec![Impact {
            start_s: 0.0,
            peak_n: 3000.0,
            pulse_s: 0.01,
        }],
        seconds: 4.0,
    };
    let (recording, _) = Rig {
        sample_rate_hz: 4000.0,
        ..rig(impact, &effects)
    }
    .record(&linear(), Path::new("a.csv"))
    .unwrap();
    let y = samples(&recording, "y");
    let crossings: Vec<f64> = (200..y.len())
        .filter(|&i| y[i - 1] < 0.0 && y[i] >= 0.0)
        .map(|i| (i as f64 - y[i] / (y[i] - y[i - 1])) / 4000.0)
        .collect();
    let period = (crossings[crossings.len() - 1] - crossings[0]) / (crossings.len() - 1) as f64;
    let amplitude = y[200..].iter().fold(0.0_f64, |a, x| a.max(x.abs()));
    let (gap, omega) = (0.05e-3, (2.26e6_f64 / 188.0).sqrt());
    let wanted = 4.0 * (0.5 * PI + gap / (amplitude - gap)) / omega;
    // Sampling lowers the peak by up to (ωdt)²/8 = 1e-4 of its height.
    assert!((period / wanted - 1.0).abs() < 2e-4, "{period} {wanted}");
}

#[test]
fn hysteresis_saturates_and_its_loop_has_the_area_of_friction() {
    // Far beyond yield, a Bouc–Wen element is a friction force k_h·z_y in parallel with a spring −k_h. Its loop has the area
    // 4·k_h·z_y·X, reduced by its rounded corners by a fraction of about z_y/X.
    let effects = [
        "hysteresis=2e6",
        "hysteresis.yield_m=1e-6",
        "hysteresis.exponent=1",
    ];
    let tone = Signal::tones(&[3.0], [400.0, 400.0], 12.0, 1);
    let (recording, _) = Rig {
        sample_rate_hz: 30_000.0,
        ..rig(tone, &effects)
    }
    .record(&linear(), Path::new("a.csv"))
    .unwrap();
    let from = recording.len() - 10_000;
    let (y, f) = (samples(&recording, "y"), samples(&recording, "fy"));
    let v = samples(&recording, "vy");
    let work: f64 = (from..recording.len()).map(|i| f[i] * v[i]).sum::<f64>() / 30_000.0;
    let viscous: f64 = (from..recording.len()).map(|i| 305.0 * v[i] * v[i]).sum::<f64>() / 30_000.0;
    let amplitude = y[from..].iter().fold(0.0_f64, |a, x| a.max(x.abs()));
    let wanted = 4.0 * 2e6 * 1e-6 * amplitude;
    assert!(amplitude > 100e-6, "{amplitude}");
    assert!(
        ((work - viscous) / wanted - 1.0).abs() < 0.03,
        "{} {wanted}",
        work - viscous
    );
}

#[test]
fn a_missing_mode_adds_to_the_receptance() {
    let effects = [
        "missing-mode=19",
        "missing-mode.modal_mass_kg=300",
        "missing-mode.damping_ratio=0.03",
    ];
    let tone = Signal::tones(&[18.5], [1.0, 1.0], 40.0, 1);
    let (recording, _) = rig(tone, &effects).record(&linear(), Path::new("a.csv")).unwrap();
    let omega = TAU * 18.5;
    let own = TAU * 19.0;
    let added = num_complex::Complex64::new(own * own - omega * omega, 2.0 * 0.03 * own * omega);
    let h = linear().first_order().unwrap().receptance(omega).unwrap()[(1, 1)] + (300.0 * added).inv();
    let amplitude = samples(&recording, "y")[19_000..]
        .iter()
        .fold(0.0_f64, |a, x| a.max(x.abs()));
    // A thousand samples at 27 per period, at phases that drift: some lie so near to a peak that the error is below 1e-3.
    assert!(
        (amplitude / h.norm() - 1.0).abs() < 1e-3,
        "{amplitude} {}",
        h.norm()
    );
}

#[test]
fn mode_coupling_conserves_energy() {
    // Energy is kept: without damping the sum of kinetic and all potential energy is that which the impact gave.
    let structure = case("kuka-kr90-half").structure.unwrap();
    let effects = [
        "damping=-0.99999999",
        "mode-coupling=2e13",
        "mode-coupling.kxxy_n_per_m2=1e9",
    ];
    let impact = Signal::Impacts {
        impacts: vec![Impact {
            start_s: 0.0,
            peak_n: 2000.0,
            pulse_s: 0.02,
        }],
        seconds: 3.0,
    };
    let (recording, _) = rig(impact, &effects)
        .record(&structure, Path::new("a.csv"))
        .unwrap();
    let quietcut_model::structure::Form::Matrices(m) = &structure.form else {
        panic!("matrices")
    };
    let energy = |i: usize| {
        let of = |name: &str| samples(&recording, name)[i];
        let x = nalgebra::Vector2::new(of("x"), of("y"));
        let v = nalgebra::Vector2::new(of("vx"), of("vy"));
        let symmetric = 0.5 * (&m.stiffness + m.stiffness.transpose());
        0.5 * (v.dot(&(&m.mass * v)) + x.dot(&(symmetric * x)))
            + 0.5 * 2e13 * x[0] * x[0] * x[1] * x[1]
            + 1e9 * x[0] * x[0] * x[1]
    };
    let first = energy(20);
    let shared = (20..recording.len())
        .map(|i| 0.5 * 2e13 * (samples(&recording, "x")[i] * samples(&recording, "y")[i]).powi(2))
        .fold(0.0, f64::max);
    assert!(shared > 1e-3 * first, "{shared} {first}");
    for i in (20..recording.len()).step_by(7) {
        // K of the case is symmetric to 1e-4 of its diagonal.
        assert!(
            (energy(i) / first - 1.0).abs() < 1e-3,
            "{i}: {} {first}",
            energy(i)
        );
    }
}

#[test]
fn sensors_read_what_their_effects_say() {
    let tone = Signal::tones(&[17.0], [5.0, 5.0], 4.0, 1);
    let plain = rig(tone.clone(), &[])
        .record(&linear(), Path::new("a.csv"))
        .unwrap()
        .0;
    let effects = [
        "sensor-gain=1.2",
        "sensor-gain.channel=y",
        "sensor-delay=0.01",
        "sensor-delay.channel=ay",
    ];
    let altered = rig(tone, &effects)
        .record(&linear(), Path::new("a.csv"))
        .unwrap()
        .0;
    for i in 5..plain.len() {
        assert!((samples(&altered, "y")[i] - 1.2 * samples(&plain, "y")[i]).abs() < 1e-12);
        // Ten milliseconds are five samples.
        let late = samples(&plain, "ay")[i - 5];
        assert!((samples(&altered, "ay")[i] - late).abs() < 1e-9);
        assert_eq!(samples(&altered, "fy")[i], samples(&plain, "fy")[i]);
    }
}

#[test]
fn where_the_velocity_jumps_accelerations_are_means_over_a_sample() {
    // The modes of this structure have no mass matrix, so that the velocity jumps.
    let structure = case("kuka-kr90-acetal").structure.unwrap();
    let impact = Signal::Impacts {
        impacts: vec![Impact {
            start_s: 0.1,
            peak_n: 200.0,
            pulse_s: 0.02,
        }],
        seconds: 1.0,
    };
    let at = |sample_rate_hz| {
        let rig = Rig {
            sample_rate_hz,
            ..rig(impact.clone(), &[])
        };
        rig.record(&structure, Path::new("a.csv")).unwrap().0
    };
    let (means, halves) = (at(500.0), at(1000.0));
    let (means, v) = (samples(&means, "ay"), samples(&halves, "vy"));
    let largest = means
        .iter()
        .fold(0.0, |largest: f64, mean| largest.max(mean.abs()));
    assert!(largest > 0.1, "{largest}");
    for sample in 1..means.len() - 1 {
        let mean = (v[2 * sample + 1] - v[2 * sample - 1]) * 500.0;
        assert!((means[sample] - mean).abs() < 1e-6 * largest, "{sample}");
    }
}

#[test]
fn an_uncontrolled_shaker_loses_force_at_resonance() {
    let step = Signal::step_sine(&[10.0, 17.45], &[10.0], 20.0, 1.0);
    let (recording, _) = Rig {
        drop_ns_per_m: 100.0,
        ..rig(step, &[])
    }
    .record(&linear(), Path::new("a.csv"))
    .unwrap();
    let peak = |from: usize, to: usize| {
        samples(&recording, "fy")[from..to]
            .iter()
            .fold(0.0_f64, |a, x| a.max(x.abs()))
    };
    let (away, at) = (peak(7000, 9900), peak(18_000, 20_400));
    // At resonance the velocity is F/c: F = F₀·c/(c + drop).
    assert!((at / 10.0 - 305.0 / 405.0).abs() < 2e-3, "{at}");
    assert!(away > 9.5, "{away}");
}

#[test]
fn noise_repeats_by_seed_and_has_its_size() {
    let tone = Signal::tones(&[17.0], [5.0, 5.0], 40.0, 1);
    let plain = rig(tone, &[]).record(&linear(), Path::new("a.csv")).unwrap().0;
    let noise = Noise {
        relative: 0.01,
        absolute: [("fy".into(), 0.5)].into(),
    };
    let noisy = |seed| {
        let mut recording = plain.clone();
        noise.add(&mut recording, seed);
        recording
    };
    assert_eq!(noisy(3), noisy(3));
    assert_ne!(noisy(3), noisy(4));
    let deviation = |name: &str| {
        let (a, noisy) = (samples(&plain, name), noisy(3));
        let b = samples(&noisy, name);
        let sum: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
        (sum / a.len() as f64).sqrt()
    };
    let rms = (samples(&plain, "y").iter().map(|x| x * x).sum::<f64>() / plain.len() as f64).sqrt();
    // The standard deviation of 20 000 samples scatters by 0.5 %; four times that is allowed.
    assert!((deviation("y") / (0.01 * rms) - 1.0).abs() < 0.02);
    assert!((deviation("fy") / 0.5 - 1.0).abs() < 0.02);
}

#[test]
fn a_joint_with_cubic_terms_is_the_spring_that_it_makes_at_the_tool() {
    use quietcut_model::case::Case;

    let (arm_m, inertia, c, k, k3, c3) = (2.0_f64, 800.0, 1500.0, 4e6, -1e11, 3e4);
    let robot = format!(
        "[structure]\nkind = \"joints\"\ndirections = [\"x\", \"y\", \"z\"]\ntool_m = [{arm_m:?}, 0.0, 0.0]\n\
         [[structure.joint]]\naxis = [0.0, 0.0, 2.0]\npoint_m = [0.0, 0.0, 1.0]\nstiffness_nm_per_rad = {k:e}\n\
         damping_nms_per_rad = {c:e}\ncubic_stiffness_nm_per_rad3 = {k3:e}\ncubic_damping_nms3_per_rad3 = {c3:e}\n\
         mass_kg = 150.0\ncenter_m = [2.0, 0.0, 0.0]\ninertia_kg_m2 = [1.0, 1.0, 200.0]\n[posture]\njoints_deg = [0.0]\n"
    );
    // The displacement of the tool is the joint angle times the arm, the force on it the moment divided by the arm.
    let (square, fourth) = (arm_m * arm_m, arm_m.powi(4));
    let spring = format!(
        "[structure]\nkind = \"matrices\"\ndirections = [\"y\"]\nmass = [[{:e}]]\ndamping = [[{:e}]]\n\
         stiffness = [[{:e}]]\ncubic_stiffness = [[{:e}]]\ncubic_damping = [[{:e}]]\n",
        inertia / square,
        c / square,
        k / square,
        k3 / fourth,
        c3 / fourth
    );
    let pulled = |text: &str| {
        let case = Case::parse(std::path::Path::new("arm.toml"), text).unwrap();
        let signal = Signal::tones(&[11.0], [5.0, 60.0], 6.0, 1);
        let rig = Rig::new(Direction::Y, signal, 256.0);
        let path = std::path::Path::new("arm.csv");
        let (recording, _) = rig.record(case.structure().unwrap(), path).unwrap();
        recording.channel("y").unwrap().samples.clone()
    };
    let (a, b) = (pulled(&robot), pulled(&spring));
    let largest = b.iter().fold(0.0_f64, |most, y| most.max(y.abs()));
    // Cubic forces are about a hundredth of the linear ones; the error of both integrations is about 1e-7.
    let cubic = k3 / fourth * largest.powi(2) / (k / square);
    assert!(cubic.abs() > 5e-3, "{cubic}");
    for (a, b) in a.iter().zip(&b) {
        assert!((a - b).abs() < 1e-5 * largest, "{a} {b}");
    }
}

/// A sensor effect with a first-order low pass, in every channel of motion.
#[derive(Debug)]
struct Lag(f64);

impl crate::Effect for Lag {
    fn id(&self) -> crate::effect::EffectName {
        crate::effect::EffectName::SensorDelay
    }

    fn alter_channel(&self, channel: &mut Pickup) {
        if channel.quantity != Quantity::Force {
            channel
                .sections
                .push(crate::effect::FirstOrderSection::low_pass(self.0));
        }
    }
}

#[test]
fn a_sensor_with_dynamics_reads_a_tone_through_its_transfer_function() {
    let tone = Signal::tones(&[17.2], [2.0, 2.0], 42.0, 1);
    let lagging = Rig {
        effects: Effects(vec![std::sync::Arc::new(Lag(8e-3))]),
        ..rig(tone, &[])
    };
    let (recording, _) = lagging.record(&linear(), Path::new("a.csv")).unwrap();
    let omega = TAU * 17.2;
    let s = num_complex::Complex64::new(0.0, omega);
    let h = linear().first_order().unwrap().receptance(omega).unwrap()[(1, 1)] / (1.0 + 8e-3 * s);
    for k in 20_000..21_000 {
        let t = k as f64 / 500.0;
        let drive = num_complex::Complex64::from_polar(2.0, omega * t - 0.5 * PI);
        for (name, factor) in [("y", 1.0.into()), ("vy", s), ("ay", s * s)] {
            let size = (h * factor).norm();
            let wanted = (h * factor * drive).re;
            let found = samples(&recording, name)[k];
            assert!(
                (found - wanted).abs() < 1e-4 * size,
                "{name} {k}: {found} {wanted}"
            );
        }
    }
}
