use super::*;
use crate::{Entry, tests::case};
use quietcut_recording::{Sensed, SpindleSettings};

fn cut(rpm: f64, seconds: f64) -> VirtualCut {
    VirtualCut {
        entry: Entry::Ramp { seconds: 0.2 },
        ..VirtualCut::new(rpm, 1.0, seconds)
    }
}

#[test]
fn a_recording_replays_as_the_simulated_samples() {
    // One cut, simulated once as blocks of the sensor and once as a recording.
    let case = case("kuka-kr90-acetal");
    let accelerometer = Accelerometer {
        clock_error: 0.02,
        stamp_jitter_s: 0.0,
        ..Accelerometer::IIS3DWB_16G
    };
    let tachometer = TachometerModel {
        jitter_s: 0.0,
        ..TachometerModel::ONE_MARK
    };
    let cut = cut(900.0, 3.0);
    let simulated = cut.sense(&case, accelerometer, tachometer, 7).unwrap();
    let recorder = Recorder::Sensor {
        accelerometer,
        seed: 7,
    };
    let (recording, _) = cut
        .record(&case, recorder, tachometer, Path::new("cut.csv"))
        .unwrap();
    let names: Vec<&str> = recording
        .channels
        .iter()
        .map(|channel| channel.name.as_str())
        .collect();
    assert_eq!(
        names,
        ["fx", "fy", "fz", "x", "y", "z", "ax", "ay", "az", "tacho"]
    );
    let sensed = Sensed::new(&recording, SpindleSettings::default()).unwrap();
    assert_eq!(sensed.settings.tool.teeth, 2);
    assert_eq!(sensed.working_point.unwrap().axial_depth.0, 1.0);
    // The recording has another resolution: samples agree within one of its counts.
    let fine = f64::from(sensed.settings.sensor.meters_per_second2_per_count);
    let coarse = f64::from(accelerometer.sensor().meters_per_second2_per_count);
    for (a, b) in simulated.blocks.iter().zip(&sensed.blocks) {
        assert!(a.time.0.abs_diff(b.time.0) <= 1);
        for (a, b) in a.counts.iter().zip(&b.counts) {
            for (a, b) in a.iter().zip(b) {
                assert!((f64::from(*a) * coarse - f64::from(*b) * fine).abs() <= fine);
            }
        }
    }
    // Edges agree within a hundredth of a sampling interval once the edge detector knows the amplitude of the level, which it learns
    // by a quarter per revolution: the recording begins in the middle of an edge.
    let edges: Vec<u64> = simulated.edges.iter().map(|edge| edge.time.0).collect();
    let found: Vec<u64> = sensed.edges.iter().map(|edge| edge.time.0).collect();
    assert!(
        found.len() + 2 >= edges.len(),
        "{} of {}",
        found.len(),
        edges.len()
    );
    for edge in found.iter().filter(|edge| **edge > 2_000_000_000) {
        let nearest = edges.iter().map(|other| other.abs_diff(*edge)).min().unwrap();
        assert!(nearest < 400, "{edge}: {nearest} ns off");
    }
}

#[test]
fn the_ideal_record_obeys_the_equation_of_motion() {
    let case = case("kuka-kr90-full-cubic");
    let (recording, _) = cut(900.0, 1.0)
        .record(
            &case,
            Recorder::Ideal { rate_hz: 5000.0 },
            TachometerModel::ONE_MARK,
            Path::new("cut.csv"),
        )
        .unwrap();
    let quietcut_model::structure::Form::Matrices(m) = &case.structure.as_ref().unwrap().form else {
        panic!("matrices")
    };
    let of = |name: &str, k: usize| recording.channel(name).unwrap().samples[k];
    let pair =
        |prefix: &str, k| nalgebra::Vector2::new(of(&format!("{prefix}x"), k), of(&format!("{prefix}y"), k));
    let dt = 1.0 / 5000.0;
    let mut worst: f64 = 0.0;
    for k in 1..recording.len() - 1 {
        // Velocity by the central difference, with a relative error of (ω dt)²/6, which suffices since damping forces are small.
        let v = (pair("", k + 1) - pair("", k - 1)) / (2.0 * dt);
        let x = pair("", k);
        let residual = &m.mass * pair("a", k)
            + &m.damping * v
            + &m.stiffness * x
            + m.cubic_damping.as_ref().unwrap() * v.map(|v| v.powi(3))
            + m.cubic_stiffness.as_ref().unwrap() * x.map(|x| x.powi(3))
            - pair("f", k);
        worst = worst.max(residual.amax());
    }
    // Forces are up to 11 N; a kink of the motion within the central difference causes an error of some millinewtons.
    assert!(worst < 0.02, "{worst}");
    let largest = (0..recording.len())
        .map(|k| pair("f", k).amax())
        .fold(0.0, f64::max);
    assert!(largest > 5.0, "{largest}");
}

#[test]
fn mean_accelerations_add_up_to_the_velocity_where_it_jumps() {
    let case = case("kuka-kr90-acetal");
    let (recording, _) = cut(900.0, 1.0)
        .record(
            &case,
            Recorder::Ideal { rate_hz: 2000.0 },
            TachometerModel::ONE_MARK,
            Path::new("cut.csv"),
        )
        .unwrap();
    let a = &recording.channel("ay").unwrap().samples;
    let y = &recording.channel("y").unwrap().samples;
    let dt = 1.0 / 2000.0;
    let (mut speed, mut place, mut worst) = (0.0, 0.0, 0.0_f64);
    for k in 0..a.len() {
        worst = worst.max((place - y[k]).abs());
        speed += a[k] * dt;
        place += speed * dt;
    }
    let largest = y.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
    // The acceleration is summed twice by the rectangle rule, with an error of the order of dt times the velocity.
    assert!(worst < 0.05 * largest, "{worst} of {largest}");
}

#[test]
fn channels_may_be_late_scaled_and_left_out() {
    let case = case("kuka-kr90-full-cubic");
    let recorder = Recorder::Ideal { rate_hz: 5000.0 };
    let record = |effects: &[&str], measured: &[Quantity]| {
        let cut = VirtualCut {
            effects: Effects::parse(effects.iter().copied()).unwrap(),
            measured: measured.to_vec(),
            ..cut(900.0, 1.0)
        };
        let path = Path::new("cut.csv");
        cut.record(&case, recorder, TachometerModel::ONE_MARK, path)
            .unwrap()
            .0
    };
    let plain = record(
        &[],
        &[Quantity::Force, Quantity::Displacement, Quantity::Velocity],
    );
    let faulty = record(
        &[
            "sensor-delay=0.0012",
            "sensor-delay.channel=x",
            "sensor-gain=1.2",
            "sensor-gain.channel=vy",
        ],
        &[Quantity::Displacement, Quantity::Velocity],
    );
    assert!(faulty.channel("fx").is_none() && plain.channel("fx").is_some());
    let of = |recording: &Recording, name: &str, k: usize| recording.channel(name).unwrap().samples[k];
    for k in 6..plain.len() {
        // A delay of 1.2 ms is six samples; equal within rounding of the time.
        assert!((of(&faulty, "x", k) - of(&plain, "x", k - 6)).abs() < 1e-15);
        assert_eq!(of(&faulty, "vy", k), 1.2 * of(&plain, "vy", k));
        assert_eq!(of(&faulty, "y", k), of(&plain, "y", k));
    }
}

#[test]
fn a_wheel_too_fine_for_the_rate_is_refused() {
    let fine = TachometerModel {
        wheel: Wheel {
            positions: 60,
            missing: 2,
        },
        jitter_s: 0.0,
    };
    let error = cut(10_000.0, 1.0)
        .record(
            &case("kuka-kr90-acetal"),
            Recorder::Ideal { rate_hz: 26_667.0 },
            fine,
            Path::new("cut.csv"),
        )
        .unwrap_err();
    assert!(error.to_string().contains("60000 Hz"), "{error}");
}

/// A sensor effect with a first-order low pass of 3 ms, in every channel of acceleration.
#[derive(Debug)]
struct Lag;

impl crate::Effect for Lag {
    fn id(&self) -> crate::effect::EffectName {
        crate::effect::EffectName::SensorDelay
    }

    fn alter_channel(&self, channel: &mut Pickup) {
        if channel.quantity == Quantity::Acceleration {
            channel
                .sections
                .push(crate::effect::FirstOrderSection::low_pass(3e-3));
        }
    }
}

#[test]
fn an_accelerometer_with_dynamics_reads_the_filtered_acceleration() {
    let case = case("kuka-kr90-full-cubic");
    let accelerometer = Accelerometer {
        noise_g_per_root_hertz: 0.0,
        range_g: 2.0,
        ..Accelerometer::IIS3DWB_16G
    };
    let record = |effects: Effects| {
        let cut = VirtualCut {
            effects,
            ..cut(900.0, 1.0)
        };
        let recorder = Recorder::Sensor {
            accelerometer,
            seed: 1,
        };
        let (recording, _) = cut
            .record(&case, recorder, TachometerModel::ONE_MARK, Path::new("cut.csv"))
            .unwrap();
        recording.channel("ax").unwrap().samples.clone()
    };
    let truth = record(Effects::default());
    let lagging = record(Effects(vec![std::sync::Arc::new(Lag)]));
    // T·dy/dt = x − y by the trapezoidal rule at the sampling rate.
    let share = 0.5 / (3e-3 * accelerometer.rate_hz());
    let (mut y, mut error, mut size) = (0.0, 0.0, 0.0);
    for (pair, lagging) in truth.windows(2).zip(&lagging[1..]) {
        y = ((1.0 - share) * y + share * (pair[0] + pair[1])) / (1.0 + share);
        error += (y - lagging).powi(2);
        size += y * y;
    }
    // A sample is rounded to a count, and the rule damps the highest frequencies.
    assert!(error < 1e-4 * size, "{} {}", error.sqrt(), size.sqrt());
}
