//! Block in, report out: the pipeline that all callers use.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::acceleration::{Block, SampleClock, SampleClockState, Sensor};
use crate::advice::Advice;
use crate::detector::{Judgement, Reason, Verdict};
use crate::lobes::LobeTable;
use crate::spectrum::PowerSpectrum;
use crate::tachometer::{Edge, Tachometer, TachometerState, Wheel};
use crate::units::{Hertz, Nanoseconds, Rpm};
use crate::working_point::{Limits, Tool, WorkingPoint};

/// What the pipeline must be told before it starts; the host may change it over the link.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The accelerometer.
    pub sensor: Sensor,
    /// The tool.
    pub tool: Tool,
    /// The tachometer wheel; `None` where there is no tachometer.
    pub wheel: Option<Wheel>,
    /// Spindle speed to assume where there is no tachometer.
    pub assumed_speed: Option<Rpm>,
    /// What the spindle can do.
    pub limits: Option<Limits>,
}

/// The most teeth of a tool.
pub const MAX_TEETH: u8 = 12;

/// What is wrong with [`Settings`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum SettingsError {
    /// The tool has no teeth, or more than [`MAX_TEETH`].
    Teeth(u8),
    /// The wheel has no positions, or less than four teeth beside its gap.
    Wheel(Wheel),
    /// The sample rate is not within 1 to 100 kHz.
    SampleRate(Hertz),
    /// The value of one count is not a positive number.
    CountScale(f32),
    /// The noise of the sensor is not a number of at least 0.
    Noise(f32),
    /// The assumed speed is not a positive number.
    AssumedSpeed(Rpm),
    /// The slowest speed is not a positive number, or not below the fastest.
    Limits(Limits),
}

impl core::fmt::Display for SettingsError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Teeth(n) => write!(f, "a tool with {n} teeth: 1 to {MAX_TEETH} are possible"),
            Self::Wheel(wheel) => write!(
                f,
                "a wheel with {} positions of which {} are missing: at least 1 position, and 4 teeth beside a gap, are needed",
                wheel.positions, wheel.missing
            ),
            Self::SampleRate(rate) => write!(f, "a sample rate of {rate}: 1000 to 100000 Hz are possible"),
            Self::CountScale(scale) => write!(f, "a count of {scale} m/s²: it must be a number above 0"),
            Self::Noise(noise) => write!(
                f,
                "a sensor noise of {noise} m/s² per √Hz: it must be a number of at least 0"
            ),
            Self::AssumedSpeed(speed) => {
                write!(f, "an assumed speed of {speed}: it must be a number above 0")
            }
            Self::Limits(limits) => write!(
                f,
                "a spindle from {} to {}: the slowest speed must be above 0 and below the fastest",
                limits.rpm_min, limits.rpm_max
            ),
        }
    }
}

impl core::error::Error for SettingsError {}

/// A frequency band of the signal chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Band {
    /// Modes of a robot or a machine's frame: 5 to 400 Hz.
    Structure,
    /// Modes of tool, holder and spindle: up to 5 kHz.
    Tool,
}

/// A point of the stroboscopic map: what the sensor felt when a tooth stood at a fixed angle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Strobe {
    /// The band it was taken from.
    pub band: Band,
    /// Tooth passings since the tachometer locked. Its remainder by the number of teeth names the tooth.
    pub tooth: u32,
    /// Acceleration in the three axes, in m/s².
    pub meters_per_second2: [f32; 3],
}

/// The most [`Strobe`]s that one block makes.
pub const MAX_BLOCK_STROBES: usize = 32;

/// What the pipeline says after each block.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Sequence number of the block.
    pub sequence: u32,
    /// Time of the last sample of the block.
    pub time: Nanoseconds,
    /// Spindle speed, where it is known.
    pub speed: Option<Rpm>,
    /// The verdict and what it rests on.
    pub judgement: Judgement,
    /// What to do about it.
    pub advice: Option<Advice>,
    /// Samples clipped since the start.
    pub clipped: u32,
    /// Samples lost since the start.
    pub lost: u32,
}

/// The pipeline, set up. It never changes; what it learns is in [`State`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Monitor {
    settings: Settings,
    sample_clock: SampleClock,
    tachometer: Option<Tachometer>,
}

/// What the pipeline knows from the blocks so far. `State::default()` knows nothing.
#[derive(Clone, Debug, Default)]
pub struct State {
    sample_clock: SampleClockState,
    tachometer: TachometerState,
    strobes: Vec<Strobe, MAX_BLOCK_STROBES>,
}

impl State {
    /// The points of the stroboscopic map that the newest block made, oldest first.
    pub fn strobes(&self) -> &[Strobe] {
        &self.strobes
    }

    /// The newest spectrum of a band, summed over the axes; `None` before the first.
    pub fn spectrum(&self, _band: Band) -> Option<PowerSpectrum<'_>> {
        None
    }

    /// True where the newest block completed a spectrum of the band.
    pub fn has_fresh_spectrum(&self, _band: Band) -> bool {
        false
    }

    /// The sample clock: rate, clips, losses.
    pub fn sample_clock(&self) -> &SampleClockState {
        &self.sample_clock
    }

    /// The tachometer: speed per turn, rejected and missing edges.
    pub fn tachometer(&self) -> &TachometerState {
        &self.tachometer
    }
}

impl Monitor {
    /// Sets the pipeline up.
    ///
    /// # Errors
    /// [`SettingsError`] names the setting that cannot be, with its value.
    pub fn new(settings: Settings) -> Result<Self, SettingsError> {
        check(&settings)?;
        let tachometer = match settings.wheel {
            None => None,
            Some(wheel) => Some(Tachometer::new(wheel).ok_or(SettingsError::Wheel(wheel))?),
        };
        Ok(Self {
            settings,
            sample_clock: settings.sensor.clock(),
            tachometer,
        })
    }

    /// The settings it was made from.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Takes the next block, and the tachometer edges up to the end of the block that no step has seen yet.
    ///
    /// Edges may come in any block that is not later than one turn; they must be in the order of their time.
    pub fn step(
        &self,
        state: &mut State,
        block: &Block,
        edges: &[Edge],
        table: Option<&LobeTable<'_>>,
        working_point: Option<&WorkingPoint>,
    ) -> Report {
        let _ = (table, working_point);
        state.strobes.clear();
        self.sample_clock.observe(&mut state.sample_clock, block);
        let last = (block.counts.len() as u32).saturating_sub(1);
        let time = state.sample_clock.time_of(last).unwrap_or(block.time);
        if let Some(tachometer) = &self.tachometer {
            for &edge in edges {
                tachometer.observe(&mut state.tachometer, edge);
            }
            tachometer.expire(&mut state.tachometer, time);
        }
        let measured = self
            .tachometer
            .and_then(|tachometer| tachometer.speed(&state.tachometer));
        Report {
            sequence: block.sequence,
            time,
            speed: measured.or(self.settings.assumed_speed),
            judgement: Judgement {
                verdict: Verdict::Indeterminate,
                reason: Reason::TooShort,
                chatter: None,
                multiplier_abs: None,
                confidence: 0.0,
            },
            advice: None,
            clipped: state.sample_clock.clipped(),
            lost: state.sample_clock.lost(),
        }
    }
}

/// Refuses settings that cannot be. Not-a-number fails every comparison, so each test is for what must hold.
fn check(settings: &Settings) -> Result<(), SettingsError> {
    let Settings {
        sensor,
        tool,
        assumed_speed,
        limits,
        ..
    } = settings;
    if !(1..=MAX_TEETH).contains(&tool.teeth) {
        return Err(SettingsError::Teeth(tool.teeth));
    }
    if !(1e3..=1e5).contains(&sensor.nominal_rate.0) {
        return Err(SettingsError::SampleRate(sensor.nominal_rate));
    }
    let scale = sensor.meters_per_second2_per_count;
    if !(scale > 0.0 && scale.is_finite()) {
        return Err(SettingsError::CountScale(scale));
    }
    let noise = sensor.noise_meters_per_second2_per_root_hertz;
    if !(noise >= 0.0 && noise.is_finite()) {
        return Err(SettingsError::Noise(noise));
    }
    if let Some(speed) = assumed_speed
        && !(speed.0 > 0.0 && speed.0.is_finite())
    {
        return Err(SettingsError::AssumedSpeed(*speed));
    }
    if let Some(limits) = limits
        && !(limits.rpm_min.0 > 0.0 && limits.rpm_min.0 < limits.rpm_max.0 && limits.rpm_max.0.is_finite())
    {
        return Err(SettingsError::Limits(*limits));
    }
    Ok(())
}
