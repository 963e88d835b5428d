//! Alarms end, and hearing survives: standstill, higher speeds, lost blocks, a dead sensor, a signal on the border of two verdicts.

#![allow(clippy::unwrap_used)]

use quietcut_core::acceleration::{Block, Sensor};
use quietcut_core::detector::{Judgement, Verdict};
use quietcut_core::monitor::{Monitor, Report, Settings, State};
use quietcut_core::tachometer::{Edge, Wheel};
use quietcut_core::units::{Nanoseconds, Rpm};
use quietcut_core::working_point::Tool;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A machine whose vibration is given as a function of time and spindle angle.
struct Machine<'a> {
    teeth: u8,
    wheel: Option<Wheel>,
    assumed_rpm: Option<f32>,
    /// Revolutions per second as a function of time.
    speed: &'a dyn Fn(f64) -> f64,
    /// Acceleration in m/s² as a function of time and angle in revolutions; NaN where the sensor is dead and gives 0.
    acceleration: &'a dyn Fn(f64, f64) -> f64,
    /// Numbers of the blocks that are lost.
    lost: &'a dyn Fn(usize) -> bool,
    seconds: f64,
    seed: u64,
}

const SAMPLES: usize = 64;

impl Machine<'_> {
    /// The judgements with the times of their blocks, s.
    fn judgements(&self) -> Vec<(f64, Judgement)> {
        let reports = self.reports().into_iter();
        reports.map(|(time, report)| (time, report.judgement)).collect()
    }

    /// The reports with the times of their blocks, s.
    fn reports(&self) -> Vec<(f64, Report)> {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let sensor = Sensor::IIS3DWB_16G;
        let monitor = Monitor::new(Settings {
            sensor,
            tool: Tool { teeth: self.teeth },
            wheel: self.wheel,
            assumed_speed: self.assumed_rpm.map(Rpm),
            limits: None,
        })
        .unwrap();
        let mut state = Box::new(State::new());
        let rate = f64::from(sensor.nominal_rate.0);
        let scale = f64::from(sensor.meters_per_second2_per_count);
        let noise = f64::from(sensor.noise_meters_per_second2_per_root_hertz) * (0.5 * rate).sqrt();
        let (mut angle, mut before) = (0.3, 0.3_f64);
        let mut edges = Vec::new();
        let mut reports = Vec::new();
        let mut lost_before = false;
        for number in 0..(self.seconds * rate) as usize / SAMPLES {
            let start = (number * SAMPLES) as f64 / rate;
            let mut block = Block {
                sequence: number as u32,
                time: at(start),
                ..Block::default()
            };
            for n in 0..SAMPLES {
                let time = start + n as f64 / rate;
                angle += (self.speed)(time) / rate;
                if angle.floor() > before.floor() {
                    edges.push(Edge { time: at(time) });
                }
                before = angle;
                let value = (self.acceleration)(time, angle);
                let counts = [value, 0.6 * value, 9.8].map(|axis| {
                    let felt = axis + noise * random.random_range(-1.7..1.7);
                    let counts = (felt / scale).round().clamp(-32768.0, 32767.0) as i16;
                    if value.is_nan() { 0 } else { counts }
                });
                block.counts.push(counts).unwrap();
            }
            if (self.lost)(number) {
                lost_before = true;
                continue;
            }
            block.lost = if lost_before { SAMPLES as u32 } else { 0 };
            lost_before = false;
            let report = monitor.step(&mut state, &block, &edges, None, None);
            edges.clear();
            reports.push((start, report));
        }
        reports
    }
}

fn at(seconds: f64) -> Nanoseconds {
    Nanoseconds(1_000_000_000 + (seconds * 1e9).round() as u64)
}

const ONE_MARK: Option<Wheel> = Some(Wheel {
    positions: 1,
    missing: 0,
});

fn never(_: usize) -> bool {
    false
}

fn tone(hertz: f64, time: f64) -> f64 {
    (std::f64::consts::TAU * hertz * time).sin()
}

/// Vibration synchronous with `teeth` teeth.
fn forced(teeth: f64, angle: f64) -> f64 {
    tone(teeth, angle) + 0.4 * tone(2.0 * teeth, angle + 0.1)
}

/// Amplitude of chatter that grows from 1 s on and is full at 1.3 s.
fn onset(time: f64) -> f64 {
    (20.0 * (time - 1.3)).exp().min(1.0)
}

/// Time of the first alarm and of the last, s.
fn alarms(judgements: &[(f64, Judgement)]) -> Option<(f64, f64)> {
    let mut times = judgements
        .iter()
        .filter(|(_, judgement)| judgement.verdict.is_chatter())
        .map(|&(time, _)| time);
    let first = times.next()?;
    Some((first, times.next_back().unwrap_or(first)))
}

#[test]
fn the_alarm_ends_after_an_emergency_stop() {
    for chatter_hz in [617.0, 287.0, 83.0] {
        for stop_s in [0.02, 0.3] {
            let stops = |time: f64| (1.0 - (time - 3.0) / stop_s).clamp(0.0, 1.0);
            let judgements = Machine {
                teeth: 3,
                wheel: ONE_MARK,
                assumed_rpm: None,
                speed: &|time| 25.0 * stops(time),
                acceleration: &|time, angle| {
                    let cut = if time > 0.7 { 1.0 } else { 0.05 };
                    // The tool sticks in the material: the machine hums on, at a hundredth of the level.
                    stops(time)
                        * (cut * 5.0 * forced(3.0, angle) + 40.0 * onset(time) * tone(chatter_hz, time))
                        + 0.3 * tone(148.0, time)
                },
                lost: &never,
                seconds: 7.0,
                seed: 1,
            }
            .judgements();
            let (first, last) = alarms(&judgements).unwrap();
            println!("{chatter_hz} Hz, {stop_s} s: from {first} to {last}");
            assert!(first < 1.6 && last < 3.0 + stop_s + 1.0);
        }
    }
}

/// Two teeth that have little in common, 0.3 m/s², and differ by `alternating` m/s²; the spindle stops at 4 s.
fn alternating_cut(alternating: f64) -> Vec<(f64, Report)> {
    Machine {
        teeth: 2,
        wheel: ONE_MARK,
        assumed_rpm: None,
        speed: &|time| if time < 4.0 { 25.0 } else { 0.0 },
        acceleration: &|time, angle| {
            let turns = if time < 4.0 { 1.0 } else { 0.0 };
            turns * (0.3 * forced(2.0, angle) + alternating * tone(1.0, angle + 0.07))
        },
        lost: &never,
        seconds: 6.0,
        seed: 9,
    }
    .reports()
}

#[test]
fn what_may_be_a_flip_and_is_too_large_for_runout_is_an_alarm_until_the_spindle_stands() {
    let alarms = |reports: &[(f64, Report)]| -> Vec<f64> {
        let raised = reports.iter().filter(|(_, report)| report.alarm);
        raised.map(|(time, _)| *time).collect()
    };
    let large = alternating_cut(60.0);
    let raised = alarms(&large);
    let (first, last) = (raised.first().unwrap(), raised.last().unwrap());
    println!("from {first} to {last}");
    assert!(*first < 3.0 && *last > 3.9 && *last < 5.0);
    let (_, before_the_stop) = large.iter().rev().find(|(time, _)| *time < 3.9).unwrap();
    assert_eq!(before_the_stop.judgement.verdict, Verdict::Indeterminate);
    // As much as a runout of 50 µm may make at 0.1 mm per tooth.
    assert!(alarms(&alternating_cut(20.0)).is_empty());
}

#[test]
fn the_alarm_ends_beyond_the_speed_up_to_which_its_band_is_sampled() {
    // Four teeth at 20 and at 150 revolutions per second: the structure band has 8 samples per tooth period up to 52.
    let speed = |time: f64| {
        if time < 3.0 {
            20.0
        } else {
            (20.0 + 200.0 * (time - 3.0)).min(150.0)
        }
    };
    let judgements = Machine {
        teeth: 4,
        wheel: ONE_MARK,
        assumed_rpm: None,
        speed: &speed,
        acceleration: &|time, angle| {
            let chatter = if time < 3.1 { onset(time) } else { 0.0 };
            5.0 * forced(4.0, angle) + 40.0 * chatter * tone(97.0, time)
        },
        lost: &never,
        seconds: 8.0,
        seed: 2,
    }
    .judgements();
    let (first, last) = alarms(&judgements).unwrap();
    println!("from {first} to {last}");
    assert!(first < 1.6 && last < 4.1);
}

#[test]
fn a_lost_block_costs_no_more_than_its_length() {
    let chatter = |time: f64, angle: f64| 5.0 * forced(3.0, angle) + 40.0 * onset(time) * tone(287.0, time);
    let judgements = |lost: &dyn Fn(usize) -> bool| {
        Machine {
            teeth: 3,
            wheel: ONE_MARK,
            assumed_rpm: None,
            speed: &|_| 25.0,
            acceleration: &chatter,
            lost,
            seconds: 4.0,
            seed: 3,
        }
        .judgements()
    };
    let (whole, _) = alarms(&judgements(&never)).unwrap();
    // One block, at any time of the growth.
    for place in (400..640).step_by(20) {
        let broken = judgements(&|number| number == place);
        let (first, last) = alarms(&broken).unwrap();
        println!("{whole} s without, {first} s without block {place}");
        assert!(first < whole + 0.1 && last > 3.9);
        let silent = broken
            .iter()
            .filter(|(time, judgement)| *time > first && !judgement.verdict.is_chatter());
        assert_eq!(silent.count(), 0, "the alarm stops without block {place}");
    }
    // And now and then while it lasts.
    let broken = judgements(&|number| number > 700 && number % 97 == 0);
    let (first, _) = alarms(&broken).unwrap();
    let silent = broken
        .iter()
        .filter(|(time, judgement)| *time > first && !judgement.verdict.is_chatter());
    assert_eq!(silent.count(), 0);
}

#[test]
fn hum_after_a_dead_input_is_no_chatter() {
    let judgements = Machine {
        teeth: 4,
        wheel: None,
        assumed_rpm: Some(3000.0),
        speed: &|_| 50.0,
        acceleration: &|time, _| {
            if time < 2.0 {
                f64::NAN
            } else {
                2.0 * tone(731.0, time)
            }
        },
        lost: &never,
        seconds: 6.0,
        seed: 4,
    }
    .judgements();
    assert_eq!(alarms(&judgements), None);
}

#[test]
fn verdicts_change_at_most_once_a_second() {
    for seed in 0..4 {
        let judgements = Machine {
            teeth: 4,
            wheel: ONE_MARK,
            assumed_rpm: None,
            speed: &|_| 40.0,
            acceleration: &|time, angle| {
                // A cut near its limit: a mode that hard spots excite, and that decays slowly.
                let since = (time * 7.0).fract() / 7.0;
                let cut = if time > 0.7 { 1.0 } else { 0.02 };
                cut * (4.0 * forced(4.0, angle) + 3.0 * (-6.0 * since).exp() * tone(345.0, time))
            },
            lost: &never,
            seconds: 8.0,
            seed,
        }
        .judgements();
        let mut changes = Vec::new();
        let undecided = |pair: &&[(f64, Judgement)]| pair[1].1.verdict == Verdict::Indeterminate;
        for pair in judgements.windows(2).skip_while(undecided) {
            let (before, after) = (&pair[0].1, &pair[1].1);
            let is_onset = after.verdict.is_chatter() && !before.verdict.is_chatter();
            let differs = before.verdict != after.verdict
                || before.verdict == Verdict::Indeterminate && before.reason != after.reason;
            if differs && !is_onset {
                changes.push(pair[1].0);
            }
        }
        println!("seed {seed}: {changes:?}");
        assert!(changes.windows(2).all(|pair| pair[1] - pair[0] > 0.99));
    }
}

/// Twelve teeth at 30 000 rev/min pass 6000 times a second: the tool band is sampled at fixed angles up to 5333.
fn beyond_the_sampled_tooth_rate(acceleration: &dyn Fn(f64, f64) -> f64) -> Vec<(f64, Judgement)> {
    Machine {
        teeth: 12,
        wheel: ONE_MARK,
        assumed_rpm: None,
        speed: &|_| 500.0,
        acceleration,
        lost: &never,
        seconds: 4.0,
        seed: 11,
    }
    .judgements()
}

#[test]
fn a_new_tone_is_chatter_beyond_the_sampled_tooth_rate_and_a_quiet_cut_is_none() {
    let quiet = |time: f64, angle: f64| {
        let cut = if time > 0.7 { 1.0 } else { 0.05 };
        cut * 5.0 * forced(1.0, angle)
    };
    let chatter = beyond_the_sampled_tooth_rate(&|time, angle| {
        quiet(time, angle) + 40.0 * onset(time) * tone(1234.0, time)
    });
    let (first, last) = alarms(&chatter).unwrap();
    println!("from {first} to {last}");
    assert!(first > 1.0 && first < 1.6 && last > 3.9);
    let (_, judgement) = chatter.last().unwrap();
    assert!(
        (judgement.chatter.unwrap().0 - 1234.0).abs() < 7.0,
        "{judgement:?}"
    );
    assert_eq!(alarms(&beyond_the_sampled_tooth_rate(&quiet)), None);
}

/// A cut without tachometer at 3000 rev/min with four teeth, recorded from its middle on.
fn without_tachometer(nominal_rpm: f32, acceleration: &dyn Fn(f64, f64) -> f64) -> Vec<(f64, Judgement)> {
    Machine {
        teeth: 4,
        wheel: None,
        assumed_rpm: Some(nominal_rpm),
        speed: &|_| 50.0,
        acceleration,
        lost: &never,
        seconds: 5.0,
        seed: 7,
    }
    .judgements()
}

#[test]
fn plain_chatter_is_found_from_acceleration_and_a_nominal_speed() {
    for (chatter_hz, nominal_rpm) in [(923.0, 3000.0), (626.0, 3010.0), (328.0, 2992.0)] {
        // The teeth modulate the chatter; there was no quiet before.
        let judgements = without_tachometer(nominal_rpm, &|time, angle| {
            4.0 * forced(4.0, angle) + 12.0 * (1.0 + 0.4 * tone(4.0, angle)) * tone(chatter_hz, time)
        });
        let (first, last) = alarms(&judgements).unwrap();
        println!("{chatter_hz} Hz: from {first} to {last}");
        assert!(first < 2.0 && last > 4.9);
        let judgement = judgements.last().unwrap().1;
        assert_eq!(judgement.verdict, Verdict::Hopf);
        assert!((f64::from(judgement.chatter.unwrap().0) - chatter_hz).abs() < 0.01 * chatter_hz);
    }
}

#[test]
fn without_tachometer_a_quiet_cut_is_stable_and_air_is_air() {
    let cut = without_tachometer(3000.0, &|time, angle| {
        4.0 * forced(4.0, angle) + 0.3 * tone(731.0, time)
    });
    assert_eq!(alarms(&cut), None);
    assert_eq!(cut.last().unwrap().1.verdict, Verdict::Stable);
    // The hum of a pump, louder than the unbalance of the spindle.
    let air = without_tachometer(3000.0, &|time, angle| {
        0.2 * tone(1.0, angle) + 1.5 * tone(731.0, time)
    });
    assert_eq!(alarms(&air), None);
    assert_eq!(air.last().unwrap().1.verdict, Verdict::AirCut);
}
