//! Feeds a session to the signal chain and notes what it said, and when it should have.

use std::f64::consts::TAU;

use quietcut_core::detector::{Judgement, Verdict};
use quietcut_core::monitor::{Monitor, Settings, State};
use quietcut_core::tachometer::Wheel;
use quietcut_core::working_point::Tool;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

use super::literature::{self, Literature};
use super::sensors::Sensors;
use super::session::{Phase, STABLE, Session};

/// L of the bound n*: the logarithm of the likelihood ratio at which a sequential test decides.
const LIKELIHOOD: f64 = 38.0;

/// Passings that a sequential test needs at least for growth by `abs` per passing from 3 rms on, against |μ| = 0.95.
pub fn bound(abs: f64) -> f64 {
    let ratio =
        2.0 * LIKELIHOOD * (abs * abs - 1.0) * (1.0 - STABLE * STABLE) / (9.0 * (abs - STABLE).powi(2));
    (1.0 + ratio).ln() / (2.0 * abs.ln())
}

/// Passings after the clock's start within which an alarm is in time.
pub fn allowed(abs: f64, tooth_period_s: f64) -> f64 {
    (6.0 + 1.5 * bound(abs)).max(0.02 / tooth_period_s)
}

/// Verdicts and alarms in a session.
#[derive(Clone, Debug)]
pub struct Heard {
    pub session: Session,
    pub seconds: f64,
    /// Begin of each phase that was met.
    pub phases: Vec<(Phase, f64)>,
    /// Verdict at the end of each phase.
    pub verdicts: Vec<(Phase, Verdict)>,
    /// Onsets of alarms outside growth, with what they said.
    pub false_onsets: Vec<(Phase, f64, Judgement)>,
    /// Start of the clock, s; `None` where the growing motion never stood out.
    pub clock_s: Option<f64>,
    /// First alarm after growth began.
    pub alarm_s: Option<f64>,
    /// Frequency said 0.3 s or 10 chatter periods after the alarm.
    pub frequency_hz: Option<f64>,
    /// Time from the begin of the stop to the end of the alarm; `None` without an alarm then.
    pub alarm_end_s: Option<f64>,
    /// Changes of the verdict that are no onset of an alarm.
    pub changes: usize,
    /// Largest number of them within a second.
    pub most_changes: usize,
    /// For each detector of the literature and each of its thresholds: false onsets, and the first alarm after growth began, s.
    pub literature: [[(usize, Option<f64>); FACTORS.len()]; literature::NAMES.len()],
}

/// Thresholds of the detectors of the literature, as factors over their calibration.
pub const FACTORS: [f64; 4] = [1.5, 3.0, 6.0, 12.0];

impl Heard {
    /// Delay of the alarm in passings; infinite where it is missing. `None` where nothing is to be heard.
    pub fn delay(&self) -> Option<f64> {
        self.delay_of(self.alarm_s)
    }

    /// Delay of an alarm at this time, as [`delay`](Self::delay).
    pub fn delay_of(&self, alarm_s: Option<f64>) -> Option<f64> {
        let clock = self.clock_s?;
        Some(alarm_s.map_or(f64::INFINITY, |alarm| {
            ((alarm - clock) / self.session.machine.tooth_period_s()).max(0.0)
        }))
    }

    /// Relative error of the chatter frequency that was said; infinite where none was. `None` without an alarm that was due.
    pub fn frequency_error(&self) -> Option<f64> {
        let hz = self.session.floquet.as_ref()?.frequency_hz;
        self.alarm_s.and(self.clock_s)?;
        Some(
            self.frequency_hz
                .map_or(f64::INFINITY, |said| (said / hz - 1.0).abs()),
        )
    }

    pub fn multiplier_abs(&self) -> f64 {
        self.session.floquet.as_ref().map_or(0.0, |f| f.multiplier.norm())
    }
}

/// Runs a session through the signal chain.
pub fn listen(session: &Session) -> Heard {
    let mut sensors = Sensors::new(session);
    let monitor = Monitor::new(Settings {
        sensor: sensors.sensor,
        tool: Tool {
            teeth: session.machine.teeth as u8,
        },
        wheel: Some(Wheel {
            positions: 1,
            missing: 0,
        }),
        assumed_speed: None,
        limits: None,
    })
    .unwrap();
    let mut state = Box::new(State::new());
    let mut log = Log::new(session);
    let mut literature = Literature::new();
    while let Some(sensed) = sensors.block() {
        let report = monitor.step(&mut state, &sensed.block, &sensed.edges, None, None);
        log.take(&sensed, report.judgement);
        literature.take(&sensed);
        if log.growth_is_over(sensed.time_s) {
            sensors.motion.end_phase(sensed.time_s);
        }
    }
    let mut heard = log.end();
    heard.literature = std::array::from_fn(|detector| {
        FACTORS.map(|factor| literature::alarms(&literature.statistics, detector, factor))
    });
    heard
}

/// Notes the verdicts block by block.
struct Log<'a> {
    session: &'a Session,
    heard: Heard,
    phase: Option<Phase>,
    began_s: f64,
    verdict: Verdict,
    was_alarm: bool,
    /// The last second of acceleration in the stable cut, in counts.
    record: Vec<[f64; 3]>,
    noise: Option<f64>,
    levels: Vec<(f64, f64)>,
    changes: Vec<f64>,
    was_decided: bool,
}

impl<'a> Log<'a> {
    fn new(session: &'a Session) -> Self {
        Self {
            heard: Heard {
                session: session.clone(),
                seconds: 0.0,
                phases: Vec::new(),
                verdicts: Vec::new(),
                false_onsets: Vec::new(),
                clock_s: None,
                alarm_s: None,
                frequency_hz: None,
                alarm_end_s: None,
                changes: 0,
                most_changes: 0,
                literature: Default::default(),
            },
            session,
            phase: None,
            began_s: 0.0,
            verdict: Verdict::Indeterminate,
            was_alarm: false,
            record: Vec::new(),
            noise: None,
            levels: Vec::new(),
            changes: Vec::new(),
            was_decided: false,
        }
    }

    fn take(&mut self, sensed: &super::sensors::Sensed, judgement: Judgement) {
        let verdict = judgement.verdict;
        let alarm = verdict.is_chatter();
        let time_s = sensed.time_s;
        self.heard.seconds = time_s;
        let phase = sensed.truth.phase;
        if self.phase != Some(phase) {
            self.end_phase();
            if phase == Phase::Growing {
                self.noise = self.noise_level();
            }
            (self.phase, self.began_s) = (Some(phase), time_s);
            self.heard.phases.push((phase, time_s));
        }
        if phase == Phase::Stable {
            self.record
                .extend(sensed.block.counts.iter().map(|c| c.map(f64::from)));
        }
        if phase == Phase::Growing {
            self.levels.push((time_s, sensed.truth.level));
        }
        if alarm && phase == Phase::Growing {
            self.heard.alarm_s.get_or_insert(time_s);
        }
        // What chatters when the stop begins may be told a moment later.
        let is_late = phase == Phase::Stop && self.session.floquet.is_some() && time_s <= self.began_s + 0.2;
        if alarm && !self.was_alarm && phase != Phase::Growing && !is_late {
            self.heard.false_onsets.push((phase, time_s, judgement));
        }
        if alarm && phase == Phase::Stop && self.session.floquet.is_some() {
            self.heard.alarm_end_s = Some(time_s - self.began_s - self.session.stop_s);
        }
        self.was_decided |= verdict != Verdict::Indeterminate;
        let is_onset = alarm && !self.was_alarm;
        if self.was_decided && verdict != self.verdict && !is_onset {
            self.changes.push(time_s);
        }
        if let (Some(alarm_s), Some(floquet)) = (self.heard.alarm_s, &self.session.floquet)
            && phase == Phase::Growing
            && time_s <= alarm_s + (10.0 / floquet.frequency_hz).max(0.3)
        {
            self.heard.frequency_hz = judgement.chatter.map(|f| f64::from(f.0));
        }
        (self.verdict, self.was_alarm) = (verdict, alarm);
    }

    fn end_phase(&mut self) {
        if let Some(phase) = self.phase {
            self.heard.verdicts.push((phase, self.verdict));
        }
    }

    /// Growth is over when the alarm had its time twice, and the frequency its own.
    fn growth_is_over(&self, time_s: f64) -> bool {
        if self.phase != Some(Phase::Growing) {
            return false;
        }
        let Some(clock) = self.clock() else { return false };
        let machine = &self.session.machine;
        let period = machine.tooth_period_s();
        let more = (2.0 * allowed(self.heard.multiplier_abs(), period) * period).max(0.4);
        time_s > clock + more
    }

    /// Logarithm of the likelihood ratio that the growing motion offers a sequential test within the time allowed, by the terms of which
    /// [`bound`] is the sum: (μ − μ₀)²·d²/(2(1 − μ₀²)) for each passing in which it grows. Loss of contact may bound the motion before: then no
    /// test can tell.
    fn likelihood(&self, clock_s: f64, threshold: f64) -> f64 {
        let abs = self.heard.multiplier_abs();
        let period = self.session.machine.tooth_period_s();
        let end_s = clock_s + allowed(abs, period) * period;
        let mut passings = Vec::new();
        for &(time, level) in &self.levels {
            let number = ((time - clock_s) / period).floor();
            if (clock_s..end_s).contains(&time) && passings.last().is_none_or(|&(last, _)| last != number) {
                passings.push((number, level));
            }
        }
        let mut sum = 0.0;
        for pair in passings.windows(2) {
            let ([(before, small), (after, large)], deviations) =
                ([pair[0], pair[1]], 3.0 * pair[0].1 / threshold);
            // Half the growth that the linear equations promise is growth.
            if large > small * (1.0 + 0.5 * (abs - 1.0)).powf(after - before) {
                let term = (abs - STABLE).powi(2) * deviations.powi(2) / (2.0 * (1.0 - STABLE * STABLE));
                sum += (after - before) * term;
            }
        }
        sum
    }

    /// Root mean square in the band of the chatter mode, half a tooth frequency to both sides, of what is not periodic with the revolution, over
    /// x and y, m/s².
    fn noise_level(&self) -> Option<f64> {
        let sensor = quietcut_core::acceleration::Sensor::IIS3DWB_16G;
        let rate = f64::from(sensor.nominal_rate.0);
        let count = (rate as usize).min(self.record.len());
        let record = &self.record[self.record.len() - count..];
        let centre = self.session.floquet.as_ref()?.frequency_hz;
        let turn_hz = self.session.machine.turns_per_second;
        let half = 0.5 * turn_hz * self.session.machine.teeth as f64;
        let mut square = 0.0;
        for axis in 0..2 {
            let window = |n: usize| 0.5 - 0.5 * (TAU * n as f64 / count as f64).cos();
            let mut line: Vec<Complex<f64>> = record
                .iter()
                .enumerate()
                .map(|(n, counts)| Complex::new(window(n) * counts[axis], 0.0))
                .collect();
            FftPlanner::new().plan_fft_forward(count).process(&mut line);
            let (mut sum, mut used, mut all) = (0.0, 0, 0);
            for (bin, value) in line.iter().enumerate().take(count / 2).skip(1) {
                let hz = bin as f64 * rate / count as f64;
                if (hz - centre).abs() > half {
                    continue;
                }
                all += 1;
                let order = hz / turn_hz;
                if ((order - order.round()) * turn_hz).abs() > 2.0 * rate / count as f64 {
                    sum += value.norm_sqr();
                    used += 1;
                }
            }
            if used == 0 {
                // The lines of a slow spindle leave nothing between them within a second.
                return None;
            }
            // A Hann window has a mean square of 3/8.
            square += sum / f64::from(used) * f64::from(all) * 2.0 / (0.375 * (count * count) as f64);
        }
        let scale = f64::from(sensor.meters_per_second2_per_count);
        Some(scale * square.sqrt())
    }

    fn end(mut self) -> Heard {
        self.end_phase();
        self.heard.clock_s = self.clock();
        self.heard.changes = self.changes.len();
        let within = |&time: &f64| {
            self.changes
                .iter()
                .filter(|&&t| t >= time && t < time + 0.99)
                .count()
        };
        self.heard.most_changes = self.changes.iter().map(within).max().unwrap_or(0);
        self.heard
    }

    /// The first time from which on the growing motion stays above three times the noise, once the depth is reached.
    fn clock(&self) -> Option<f64> {
        let (_, began) = self
            .heard
            .phases
            .iter()
            .find(|(phase, _)| *phase == Phase::Growing)?;
        let threshold = 3.0 * self.noise?;
        let from = began + self.session.growth_passings * self.session.machine.tooth_period_s();
        let is_above = |(time, level): &&(f64, f64)| *level > threshold && *time >= from;
        let above = self.levels.iter().rev().take_while(is_above);
        let (clock, _) = *above.last()?;
        (self.likelihood(clock, threshold) >= LIKELIHOOD).then_some(clock)
    }
}
