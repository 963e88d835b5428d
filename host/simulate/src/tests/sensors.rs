//! Accelerometer and tachometer of a virtual cut.

use quietcut_core::tachometer::Wheel;

use super::*;

fn sensed(accelerometer: Accelerometer, seed: u64) -> SensedCut {
    let cut = VirtualCut {
        entry: Entry::None,
        ..VirtualCut::new(900.0, 1.0, 1.0)
    };
    cut.sense(
        &case("kuka-kr90-acetal"),
        accelerometer,
        TachometerModel::ONE_MARK,
        seed,
    )
    .unwrap()
}

fn counts(sensed: &SensedCut, axis: usize) -> Vec<f64> {
    sensed
        .blocks
        .iter()
        .flat_map(|block| block.counts.iter().map(move |counts| f64::from(counts[axis])))
        .collect()
}

#[test]
fn the_same_seed_repeats_and_another_does_not() {
    let sensor = Accelerometer::IIS3DWB_16G;
    assert_eq!(sensed(sensor, 5).blocks, sensed(sensor, 5).blocks);
    assert_ne!(sensed(sensor, 5).blocks, sensed(sensor, 6).blocks);
    assert_eq!(sensed(sensor, 5).edges, sensed(sensor, 5).edges);
}

#[test]
fn blocks_are_stamped_by_the_true_clock() {
    let sensor = Accelerometer {
        clock_error: -0.03,
        stamp_jitter_s: 0.0,
        ..Accelerometer::IIS3DWB_16G
    };
    let sensed = sensed(sensor, 1);
    // One second at 25 867 Hz: whole blocks and one partial block.
    let samples: usize = sensed.blocks.iter().map(|block| block.counts.len()).sum();
    assert!(samples.abs_diff(25_867) <= 2, "{samples}");
    for (number, block) in sensed.blocks.iter().enumerate() {
        assert_eq!(block.sequence, number as u32);
        let expected_ns = number as f64 * 64.0 / (26_667.0 * 0.97) * 1e9;
        assert!((block.time.0 as f64 - expected_ns).abs() < 1.0);
        assert_eq!((block.lost, block.clipped), (0, 0));
    }
}

#[test]
fn noise_has_its_density_and_quiet_is_quiet() {
    let case = case("kuka-kr90-acetal");
    let cut = VirtualCut {
        entry: Entry::Ramp { seconds: 0.1 },
        air_s: 0.5,
        ..VirtualCut::new(900.0, 1.0, 1.5)
    };
    let listen = |noise_g_per_root_hertz: f64| {
        let sensor = Accelerometer {
            noise_g_per_root_hertz,
            range_g: 2.0,
            ..Accelerometer::IIS3DWB_16G
        };
        cut.sense(&case, sensor, TachometerModel::ONE_MARK, 3).unwrap()
    };
    // During the first half second the tool has no contact.
    let quiet = counts(&listen(0.0), 1);
    assert!(quiet[..13_000].iter().all(|count| *count == 0.0));
    let noisy = &counts(&listen(75e-6), 1)[..13_000];
    let deviation = (noisy.iter().map(|count| count * count).sum::<f64>() / noisy.len() as f64).sqrt();
    // 75 µg/√Hz over 13.3 kHz is 8.66 mg, or 142 counts of 0.061 mg; the estimate from 13 000 samples scatters by 1 %.
    assert!((deviation - 142.0).abs() < 5.0, "{deviation}");
}

#[test]
fn a_small_range_clips_and_says_so() {
    // Chatter of the tool of the benchmark: an amplitude of 14 µm at 900 Hz is an acceleration of 48 g.
    let cut = VirtualCut {
        entry: Entry::None,
        ..VirtualCut::new(10_000.0, 1.0, 0.3)
    };
    let sensor = Accelerometer {
        range_g: 2.0,
        ..Accelerometer::IIS3DWB_16G
    };
    let sensed = cut
        .sense(
            &case("insperger-2dof-ad0.05"),
            sensor,
            TachometerModel::ONE_MARK,
            1,
        )
        .unwrap();
    let clipped: usize = sensed.blocks.iter().map(|block| usize::from(block.clipped)).sum();
    let at_end = sensed
        .blocks
        .iter()
        .flat_map(|block| &block.counts)
        .filter(|counts| counts.iter().any(|count| [i16::MIN, i16::MAX].contains(count)))
        .count();
    assert!(clipped > 1000 && clipped == at_end, "{clipped} {at_end}");
}

/// Sinusoidal forces of 100 Hz along x and 3 kHz along y on a mass without spring, so that the acceleration is known exactly.
struct Slow;

impl Drive for Slow {
    fn force_n(&self, t: f64) -> [f64; 3] {
        [
            268.0 * (TAU * 100.0 * t).sin(),
            268.0 * (TAU * 3000.0 * t).sin(),
            0.0,
        ]
    }
}

use std::f64::consts::TAU;

#[test]
fn the_sensor_sees_the_acceleration_without_delay_up_to_its_band() {
    let mut case = case("kuka-kr90-full");
    if let quietcut_model::structure::Form::Matrices(matrices) = &mut case.structure.as_mut().unwrap().form {
        matrices.mass = nalgebra::DMatrix::identity(2, 2) * 268.0;
        matrices.damping *= 0.0;
        matrices.stiffness *= 0.0;
    }
    let model = Model {
        dynamics: Dynamics::new(case.structure().unwrap()).unwrap(),
        cutting: None,
        drive: Some(Box::new(Slow)),
        restoring_forces: Vec::new(),
    };
    let mut sampler = Sampler::new(&model, Accelerometer::IIS3DWB_16G);
    model
        .run(0.1, Settings::default(), |step| sampler.observe(step))
        .unwrap();
    for (number, sample) in sampler.samples().iter().enumerate().skip(20) {
        let t = number as f64 / 26_667.0;
        // Ripple of the filter 3e-4, droop of the difference over a quarter sample 2e-5 at 100 Hz, 1.3e-3 at 3 kHz.
        assert!((sample[0] - (TAU * 100.0 * t).sin()).abs() < 2e-3, "{number}");
        assert!((sample[1] - (TAU * 3000.0 * t).sin()).abs() < 4e-3, "{number}");
    }
}

#[test]
fn edges_come_at_their_angles_but_for_the_gap() {
    let tachometer = TachometerModel {
        wheel: Wheel {
            positions: 60,
            missing: 2,
        },
        jitter_s: 2e-6,
    };
    let spindle = Spindle::new(600.0);
    let edges = tachometer.edges(&spindle, 1.0, 9);
    assert_eq!(edges.len(), 10 * 58 + 1);
    let mut worst: f64 = 0.0;
    for (number, edge) in edges.iter().enumerate() {
        let position = number / 58 * 60 + number % 58;
        let expected_s = position as f64 / 600.0;
        worst = worst.max((edge.time.0 as f64 * 1e-9 - expected_s).abs());
    }
    // 581 normal variables stay within 5 standard deviations, except for one of 3000 seeds.
    assert!(worst > 2e-6 && worst < 10e-6, "{worst}");
}
