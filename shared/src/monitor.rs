//! Block in, report out: the pipeline that all callers use.

mod settings;
mod state;

use heapless::Vec;
use serde::{Deserialize, Serialize};

use crate::acceleration::{Block, Continuity, SampleClock};
use crate::advice::{self, Advice};
use crate::decimation::{Decimation, FRACTION_BITS, STRUCTURE_BAND, Sample, TOOL_BAND};
use crate::detector::Judgement;
use crate::detector::evidence::Evidence;
use crate::detector::finding::Finding;
use crate::detector::growth::{Growth, Look};
use crate::lobes::LobeTable;
use crate::math;
use crate::peaks::Rotation;
use crate::spectrum::{PowerSpectrum, STRUCTURE_POINTS, TOOL_POINTS, structure_spectrum, tool_spectrum};
use crate::synchronous::{Method, Passed, SLOTS, Sampler};
use crate::tachometer::{Edge, Tachometer, Turns};
use crate::units::{Hertz, Nanoseconds, Rpm};
use crate::working_point::WorkingPoint;

pub use settings::{MAX_TEETH, Settings, SettingsError};
pub use state::State;

use state::{Advised, Path, follow_tone};

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
    decimation: Decimation,
}

/// Samples of a band from one spectrum to the next.
const TOOL_HOP: usize = TOOL_POINTS / 2;
const STRUCTURE_HOP: usize = STRUCTURE_POINTS / 4;
/// A tooth period must have so many samples of a band to be sampled at fixed angles.
const STRUCTURE_SAMPLES_PER_TOOTH: f32 = 8.0;
const TOOL_SAMPLES_PER_TOOTH: f32 = 2.5;
/// The angle must be known to this part of a tooth period.
const LARGEST_ANGLE_DEVIATION: f32 = 0.03;
/// In the tool band growth is looked at not more often than after so many of its samples, 4 ms: what it costs.
const LOOK_SAMPLES: u32 = 53;
/// A speed that changes by more than this part per turn makes passings that cannot be compared.
const LARGEST_CHANGE_PER_TURN: f32 = 0.02;
/// So many clipped or lost samples, as a part of all, and nothing else can be said.
const LARGEST_DAMAGE: f32 = 0.05;
/// Blocks over which that is counted.
const DAMAGE_MEMORY: f32 = 64.0;
/// An assumed speed is believed to this part,
const ASSUMED_UNCERTAINTY: f32 = 0.005;
/// one that was measured to this,
const MEASURED_UNCERTAINTY: f32 = 5e-4;
/// and one that was heard at the tooth passing to this part of a bin.
const HEARD_BINS: f32 = 0.2;
/// A tooth-passing tone stands out of the noise by this factor of power at least to be believed.
const HEARD_SNR: f32 = 100.0;
/// Advice is given anew where the speed has moved by this part.
const ADVICE_SPEED_STEP: f32 = 0.002;
/// Or the chatter frequency by this part.
const ADVICE_FREQUENCY_STEP: f32 = 0.005;

/// The angle at the first sample of a block, and how it goes on.
#[derive(Clone, Copy, Debug)]
struct Angles {
    first: Turns,
    /// 2⁻³² turns per sample of the sensor.
    per_sample: u64,
    /// Standard deviation, in tooth periods.
    deviation: f32,
    /// Samples of the sensor per tooth period.
    samples_per_tooth: f32,
}

impl Angles {
    /// The angle at sample `n` of the block, less a group delay in samples.
    fn at(&self, n: usize, delay: u32) -> Turns {
        let forward = self.per_sample.wrapping_mul(n as u64);
        let back = self.per_sample.wrapping_mul(u64::from(delay));
        Turns(self.first.0.saturating_add(forward).saturating_sub(back))
    }
}

impl Monitor {
    /// Sets the pipeline up.
    ///
    /// # Errors
    /// [`SettingsError`] names the setting that cannot be, with its value.
    pub fn new(settings: Settings) -> Result<Self, SettingsError> {
        settings::check(&settings)?;
        let tachometer = match settings.wheel {
            None => None,
            Some(wheel) => Some(Tachometer::new(wheel).ok_or(SettingsError::Wheel(wheel))?),
        };
        let rate = settings.sensor.nominal_rate;
        let decimation = Decimation::new(rate).map_err(|_| SettingsError::SampleRate(rate))?;
        Ok(Self {
            settings,
            sample_clock: settings.sensor.clock(),
            tachometer,
            decimation,
        })
    }

    /// The settings it was made from.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Takes the next block, and the tachometer edges that no step has seen yet, up to the end of the block.
    ///
    /// Edges may come with a later block than the one they belong to, by a turn at most; they must be in the order of their time.
    pub fn step(
        &self,
        state: &mut State,
        block: &Block,
        edges: &[Edge],
        table: Option<&LobeTable<'_>>,
        working_point: Option<&WorkingPoint>,
    ) -> Report {
        self.take_block(state, block);
        let last = (block.counts.len() as u32).saturating_sub(1);
        let time = state.sample_clock.time_of(last).unwrap_or(block.time);
        let measured = self.take_edges(state, edges, time);
        let angles = self.angles(state);
        state.strobes.clear();
        (state.structure.passed, state.structure.fresh) = (false, false);
        (state.tool.passed, state.tool.fresh) = (false, false);
        for (n, &counts) in block.counts.iter().enumerate() {
            let output = self.decimation.step(&mut state.decimation, counts);
            if let Some(sample) = output.tool {
                self.take_tool(state, sample, n, angles.as_ref());
            }
            if let Some(sample) = output.structure {
                self.take_structure(state, sample, n, angles.as_ref());
            }
        }
        let speed = measured
            .or_else(|| state.heard_speed.map(Hertz::to_rpm))
            .or(self.settings.assumed_speed);
        self.take_spectra(state, measured.map(Rpm::to_hertz));
        let judgement = self.judge(state, speed);
        let advice = speed.and_then(|speed| self.advise(state, &judgement, speed, table, working_point));
        Report {
            sequence: block.sequence,
            time,
            speed,
            judgement,
            advice,
            clipped: state.sample_clock.clipped(),
            lost: state.sample_clock.lost(),
        }
    }

    /// Numbers the samples of the block and deals with what is missing before them.
    fn take_block(&self, state: &mut State, block: &Block) {
        let lost = match self.sample_clock.observe(&mut state.sample_clock, block) {
            Continuity::Contiguous => 0,
            Continuity::Gap(samples) => samples,
            Continuity::Restarted => block.lost.max(1),
        };
        if lost > 0 {
            state.decimation.reset();
            state.structure.interrupt();
            state.tool.interrupt();
            state.detector.interrupt();
        }
        let bad = f32::from(block.clipped) + lost as f32;
        let all = block.counts.len() as f32 + lost as f32;
        if all > 0.0 {
            state.damage += (bad / all - state.damage) / DAMAGE_MEMORY;
        }
    }

    /// Speed as measured, after all edges up to `now`.
    fn take_edges(&self, state: &mut State, edges: &[Edge], now: Nanoseconds) -> Option<Rpm> {
        let tachometer = self.tachometer.as_ref()?;
        for &edge in edges {
            tachometer.observe(&mut state.tachometer, edge);
        }
        tachometer.expire(&mut state.tachometer, now);
        if state.tachometer.losses() != state.losses {
            state.losses = state.tachometer.losses();
            state.structure.interrupt_angles();
            state.tool.interrupt_angles();
        }
        tachometer.speed(&state.tachometer)
    }

    /// The angles of the samples of the newest block.
    fn angles(&self, state: &State) -> Option<Angles> {
        let tachometer = self.tachometer.as_ref()?;
        let phase = tachometer.phase(&state.tachometer, state.sample_clock.time_of(0)?)?;
        let rate = state.sample_clock.rate()?;
        let turns = phase.turns_per_second / rate.0;
        let teeth = f32::from(self.settings.tool.teeth);
        Some(Angles {
            first: phase.angle,
            per_sample: (turns * 4_294_967_296.0) as u64,
            deviation: phase.deviation_turns * teeth,
            samples_per_tooth: 1.0 / (turns * teeth),
        })
    }

    /// White noise of the sensor and of its rounding, in (m/s²)² per Hz.
    fn noise_density(&self) -> f32 {
        let sensor = &self.settings.sensor;
        let density = sensor.noise_meters_per_second2_per_root_hertz;
        let step = sensor.meters_per_second2_per_count;
        density * density + step * step / 6.0 / sensor.nominal_rate.0
    }

    fn unit(&self) -> f32 {
        self.settings.sensor.meters_per_second2_per_count / (1 << FRACTION_BITS) as f32
    }

    /// Whether samples of a band can be taken at fixed angles.
    fn can_sample(&self, angles: &Angles, divisor: u32, least: f32) -> bool {
        angles.samples_per_tooth >= least * divisor as f32 && angles.deviation < LARGEST_ANGLE_DEVIATION
    }

    fn take_tool(&self, state: &mut State, sample: Sample, n: usize, angles: Option<&Angles>) {
        let path = &mut state.tool;
        path.take(sample, TOOL_HOP);
        let Some(angles) =
            angles.filter(|a| self.can_sample(a, self.decimation.tool_divisor(), TOOL_SAMPLES_PER_TOOTH))
        else {
            return;
        };
        let sampler = Sampler {
            teeth: self.settings.tool.teeth,
            method: Method::Value,
        };
        let angle = angles.at(n, self.decimation.tool_delay());
        let unit = self.unit();
        let Some(passed) = sampler.step(&mut path.sampler, sample.map(|x| x as f32 * unit), angle) else {
            return;
        };
        let rate = self.settings.sensor.nominal_rate.0 / self.decimation.tool_divisor() as f32;
        let noise = self.noise_density() * 0.5 * rate;
        // Not closely: samples between the samples are as good as a cubic, and what that leaves of the forced vibration turns by the samples per
        // tooth period, a tone that beats with its own harmonics.
        let look = if path.since_look >= LOOK_SAMPLES {
            Look::Quick
        } else {
            Look::None
        };
        self.take_passing(path, &passed, noise, look);
        // Slower teeth than the structure band needs are shown from there.
        if !self.can_sample(
            angles,
            self.decimation.structure_divisor(),
            STRUCTURE_SAMPLES_PER_TOOTH,
        ) {
            show(&mut state.strobes, Band::Tool, &passed);
        }
    }

    fn take_structure(&self, state: &mut State, sample: Sample, n: usize, angles: Option<&Angles>) {
        let path = &mut state.structure;
        path.take(sample, STRUCTURE_HOP);
        let divisor = self.decimation.structure_divisor();
        let Some(angles) = angles.filter(|a| self.can_sample(a, divisor, STRUCTURE_SAMPLES_PER_TOOTH)) else {
            return;
        };
        let sampler = Sampler {
            teeth: self.settings.tool.teeth,
            method: Method::Mean,
        };
        let angle = angles.at(n, self.decimation.structure_delay());
        let unit = self.unit();
        let Some(passed) = sampler.step(&mut path.sampler, sample.map(|x| x as f32 * unit), angle) else {
            return;
        };
        // A mean over w seconds lets 1/(2w) Hz of the noise through.
        let rate = self.settings.sensor.nominal_rate.0;
        let bandwidth = 0.5 * rate * SLOTS as f32 / angles.samples_per_tooth;
        let noise = self.noise_density() * bandwidth.min(0.5 * rate / divisor as f32);
        self.take_passing(path, &passed, noise, Look::Close);
        show(&mut state.strobes, Band::Structure, &passed);
    }

    fn take_passing<const POINTS: usize, const BINS: usize>(
        &self,
        path: &mut Path<POINTS, BINS>,
        passed: &Passed,
        noise: f32,
        look: Look,
    ) {
        path.floor = math::sqrt(noise);
        path.growth.push(
            passed.tooth,
            &passed.passing,
            noise,
            self.settings.tool.teeth,
            look,
        );
        if look >= Look::Quick {
            // Without a look there is nothing new to judge.
            path.passed = true;
            path.since_look = 0;
        }
    }

    /// Spectra that are due, the background, and the tones in them.
    fn take_spectra(&self, state: &mut State, measured: Option<Hertz>) {
        let rate = state
            .sample_clock
            .rate()
            .unwrap_or(self.settings.sensor.nominal_rate);
        let unit = self.unit();
        let chatter = state.detector.is_chatter();
        if state.tool.fresh {
            let band_rate = Hertz(rate.0 / self.decimation.tool_divisor() as f32);
            let path = &mut state.tool;
            let spectrum = tool_spectrum(
                &path.overlap,
                &AXES,
                band_rate,
                unit,
                &mut state.tool_work,
                &mut path.power,
            );
            path.bin = spectrum.bin;
            if measured.is_none() {
                state.heard_speed = self.hear_speed(&spectrum);
            }
        }
        if state.structure.fresh {
            let band_rate = Hertz(rate.0 / self.decimation.structure_divisor() as f32);
            let path = &mut state.structure;
            let spectrum = structure_spectrum(
                &path.overlap,
                &AXES,
                band_rate,
                unit,
                &mut state.work,
                &mut path.power,
            );
            path.bin = spectrum.bin;
        }
        if measured.is_some() {
            state.heard_speed = None;
        }
        let rotation = self.rotation(state, measured);
        if state.tool.fresh {
            follow_tone(&mut state.tool, rotation, TOOL_TONES, chatter, &mut state.work);
        }
        if state.structure.fresh {
            follow_tone(
                &mut state.structure,
                rotation,
                STRUCTURE_TONES,
                chatter,
                &mut state.work,
            );
        }
    }

    /// Revolutions per second read from a tone at the tooth passing near the assumed one.
    fn hear_speed(&self, spectrum: &PowerSpectrum<'_>) -> Option<Hertz> {
        let assumed = self.settings.assumed_speed?.to_hertz().0 * f32::from(self.settings.tool.teeth);
        let reach = ASSUMED_UNCERTAINTY * assumed + spectrum.bin.0;
        let peak = spectrum.dominant(Hertz(assumed - reach), Hertz(assumed + reach))?;
        let near = (peak.frequency.0 - assumed).abs() < reach;
        (near && peak.snr > HEARD_SNR)
            .then_some(Hertz(peak.frequency.0 / f32::from(self.settings.tool.teeth)))
    }

    /// What the spindle does, with its uncertainty.
    fn rotation(&self, state: &State, measured: Option<Hertz>) -> Option<Rotation> {
        let with = |frequency: Hertz, uncertainty: f32| Rotation {
            frequency,
            uncertainty: Hertz(uncertainty),
        };
        if let Some(measured) = measured {
            return Some(with(measured, MEASURED_UNCERTAINTY * measured.0));
        }
        if let Some(heard) = state.heard_speed {
            return Some(with(
                heard,
                HEARD_BINS * state.tool.bin.0 / f32::from(self.settings.tool.teeth),
            ));
        }
        let assumed = self.settings.assumed_speed?.to_hertz();
        Some(with(assumed, ASSUMED_UNCERTAINTY * assumed.0))
    }

    fn judge(&self, state: &mut State, speed: Option<Rpm>) -> Judgement {
        let change = state.tachometer.change_per_turn().unwrap_or(0.0);
        let sampled = self.tachometer.is_some();
        let finding = |growth: &Growth| -> Option<Finding> {
            Some(*growth.finding()).filter(|finding| sampled && finding.passings > 0)
        };
        let (structure, tool) = (finding(&state.structure.growth), finding(&state.tool.growth));
        let evidence = Evidence {
            speed: speed.map(Rpm::to_hertz),
            changing: change.abs() > LARGEST_CHANGE_PER_TURN,
            damaged: state.damage > LARGEST_DAMAGE,
            teeth: self.settings.tool.teeth,
            findings: [structure.as_ref(), tool.as_ref()],
            new_passings: [state.structure.passed, state.tool.passed],
            floors: [state.structure.floor, state.tool.floor],
            spectra: [state.structure.spectrum(), state.tool.spectrum()],
            tones: [state.structure.tone.as_ref(), state.tool.tone.as_ref()],
            heard: state.tool.background.is_learnt(),
            new_spectra: [state.structure.fresh, state.tool.fresh],
        };
        state.detector.step(&evidence)
    }

    /// Advice, given anew where something has changed.
    fn advise(
        &self,
        state: &mut State,
        judgement: &Judgement,
        speed: Rpm,
        table: Option<&LobeTable<'_>>,
        working_point: Option<&WorkingPoint>,
    ) -> Option<Advice> {
        let table_crc = table.and_then(|table| Some(table.header().ok()?.crc));
        let feed_direction = table.and_then(LobeTable::asked_direction);
        let moved = |a: f32, b: f32, step: f32| (a - b).abs() > step * b.abs();
        let same = state.advice.as_ref().filter(|advised| {
            let chatter = match (advised.chatter, judgement.chatter) {
                (Some(a), Some(b)) => !moved(a.0, b.0, ADVICE_FREQUENCY_STEP),
                (a, b) => a.is_none() && b.is_none(),
            };
            advised.verdict == judgement.verdict
                && chatter
                && !moved(advised.speed.0, speed.0, ADVICE_SPEED_STEP)
                && advised.working_point.as_ref() == working_point
                && advised.table == table_crc
                && advised.feed_direction == feed_direction
        });
        if let Some(advised) = same {
            return Some(advised.advice);
        }
        let Settings { limits, tool, .. } = &self.settings;
        let advice = advice::advise(judgement, speed, table, working_point, limits.as_ref(), tool);
        state.advice = Some(Advised {
            advice,
            verdict: judgement.verdict,
            chatter: judgement.chatter,
            speed,
            working_point: working_point.copied(),
            table: table_crc,
            feed_direction,
        });
        Some(advice)
    }
}

/// Spectra are summed over all axes.
const AXES: [usize; 3] = [0, 1, 2];
/// Where tones are looked for.
const STRUCTURE_TONES: (Hertz, Hertz) = (Hertz(5.0), STRUCTURE_BAND);
const TOOL_TONES: (Hertz, Hertz) = (Hertz(150.0), TOOL_BAND);

/// Adds a point of the stroboscopic map: what was felt at the first slot.
fn show(strobes: &mut Vec<Strobe, MAX_BLOCK_STROBES>, band: Band, passed: &Passed) {
    let [x, y, z, ..] = passed.passing;
    let strobe = Strobe {
        band,
        tooth: passed.tooth as u32,
        meters_per_second2: [x, y, z],
    };
    // More than the capacity cannot come in one block; if they did, the last would be left out.
    let _ = strobes.push(strobe);
}
