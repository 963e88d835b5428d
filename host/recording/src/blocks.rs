//! Converts a recording into the input of the monitor on the device: blocks of sensor counts, tachometer edges,
//! settings.

use quietcut_core::acceleration::{Block, Counts, MAX_BLOCK_SAMPLES, Sensor, is_clipped};
use quietcut_core::monitor::Settings;
use quietcut_core::tachometer::{Edge, LevelDetector, LevelDetectorState, Wheel};
use quietcut_core::units::{Degrees, Hertz, Millimeters, Nanoseconds, Rpm};
use quietcut_core::working_point::{Tool, WorkingPoint};

use super::channel_section::channel_section;
use super::criteria::LEAST_SWING;
use super::{Channel, Quantity, Recording, RecordingError};

/// Acceleration per count, m/s², of the IIS3DWB accelerometer in its ranges ±2, ±4, ±8 and ±16 g, in this order
/// (sensitivities of its data sheet, mg/LSB).
const COUNT: [f64; 4] = [
    0.061e-3 * 9.806_65,
    0.122e-3 * 9.806_65,
    0.244e-3 * 9.806_65,
    0.488e-3 * 9.806_65,
];

/// Largest absolute count that a converted sample takes: one below 32 767, so that the largest sample is not counted as
/// clipped.
const FULL_SCALE: f64 = 32_766.0;

/// Input of the monitor as the device would have acquired it during the recording.
#[derive(Clone, Debug)]
pub struct Sensed {
    /// Settings of the monitor: sensor, tool, tachometer wheel, assumed speed.
    pub settings: Settings,
    /// Working point of the cut; `None` if the sidecar lacks depth, entry angle, exit angle or feed.
    pub working_point: Option<WorkingPoint>,
    /// Blocks of accelerometer counts, in order of time.
    pub blocks: Vec<Block>,
    /// Rising tachometer edges, in order of time; empty without a tachometer, or if the user gives the spindle speed.
    pub edges: Vec<Edge>,
    /// False if a channel used as acceleration is recorded in another unit, such as volts, or in an unknown one;
    /// amplitudes are then relative, not in m/s².
    pub is_calibrated: bool,
}

/// Spindle speed and number of teeth that the user gives; they override those of the recording and its sidecar.
#[derive(Clone, Copy, Debug, Default)]
pub struct SpindleSettings {
    /// Spindle speed that the user gives, rev/min; it replaces a recorded tachometer, whose edges are then ignored.
    /// `None` if the user gives none.
    pub rpm: Option<f64>,
    /// Number of teeth that the user gives; it overrides that of the sidecar. `None` if the user gives none.
    pub teeth: Option<u8>,
}

impl Sensed {
    /// Converts a recording into blocks of counts, tachometer edges and settings.
    ///
    /// The acceleration channels ax, ay, az are quantized in the smallest range of the sensor that holds them all.
    /// Without them, the only channel of unknown quantity or voltage other than tacho is taken for ax. Beyond the
    /// largest range, or if a channel is not recorded in units of acceleration, the largest absolute sample sets the
    /// scale.
    ///
    /// # Errors
    /// The recording has no acceleration channel, or several that may be one; neither tachometer nor constant spindle
    /// speed; or no number of teeth, or more than 255.
    pub fn new(recording: &Recording, speed: SpindleSettings) -> Result<Self, RecordingError> {
        let (axes, is_calibrated) = axes(recording)?;
        let largest = axes
            .iter()
            .flatten()
            .flat_map(|channel| &channel.samples)
            .fold(0.0_f64, |largest, sample| largest.max(sample.abs()));
        let count = count(largest, is_calibrated);
        let teeth = teeth(recording, speed)?;
        // A spindle speed that the user gives replaces the recorded tachometer, so that recordings with a faulty
        // tachometer can be converted for the monitor.
        let wheel = wheel(recording).filter(|_| speed.rpm.is_none());
        let cut = recording.sidecar.cut.unwrap_or_default();
        let rpm = speed.rpm.or(cut.spindle_rpm.filter(|_| cut.last_rpm.is_none()));
        if wheel.is_none() && rpm.is_none() {
            return Err(recording.lacks(
                "tacho channel; without one the spindle speed must be given (--rpm, or cut.spindle_rpm beside the recording)",
            ));
        }
        let rate = recording.sample_rate_hz;
        let settings = Settings {
            sensor: Sensor {
                nominal_rate: Hertz(rate as f32),
                meters_per_second2_per_count: count as f32,
                // For channels that are not recorded in units of acceleration only the quantization noise is known:
                // variance count²/12, spread evenly from 0 to half the sample rate.
                noise_meters_per_second2_per_root_hertz: if is_calibrated {
                    Sensor::IIS3DWB_16G.noise_meters_per_second2_per_root_hertz
                } else {
                    (count / 12f64.sqrt() / (0.5 * rate).sqrt()) as f32
                },
            },
            tool: Tool { teeth },
            wheel,
            assumed_speed: rpm.filter(|_| wheel.is_none()).map(|rpm| Rpm(rpm as f32)),
            limits: None,
        };
        Ok(Self {
            settings,
            working_point: working_point(recording),
            blocks: blocks(&axes, count, rate),
            edges: if wheel.is_some() {
                edges(recording)
            } else {
                Vec::new()
            },
            is_calibrated,
        })
    }

    /// Pairs each block with its tachometer edges: the edges after the previous pair and before the start of the next
    /// block; the last block gets all remaining edges.
    pub fn steps(&self) -> impl Iterator<Item = (&Block, &[Edge])> {
        let mut rest = self.edges.as_slice();
        let ends = self
            .blocks
            .iter()
            .skip(1)
            .map(|block| block.time)
            .chain(std::iter::once(Nanoseconds(u64::MAX)));
        self.blocks.iter().zip(ends).map(move |(block, end)| {
            let (mine, later) = rest.split_at(rest.partition_point(|edge| edge.time < end));
            rest = later;
            (block, mine)
        })
    }
}

/// Channels of the recording used as acceleration along x, y and z, and whether all of them are recorded in units of
/// acceleration.
fn axes(recording: &Recording) -> Result<([Option<&Channel>; 3], bool), RecordingError> {
    let axes = ["ax", "ay", "az"].map(|name| recording.channel(name));
    if axes.iter().any(Option::is_some) {
        let calibrated = axes
            .iter()
            .flatten()
            .all(|channel| channel.quantity == Quantity::Acceleration);
        return Ok((axes, calibrated));
    }
    let unknown: Vec<&Channel> = recording
        .channels
        .iter()
        .filter(|channel| {
            channel.name != "tacho" && matches!(channel.quantity, Quantity::Unknown | Quantity::Voltage)
        })
        .collect();
    match unknown.as_slice() {
        [only] => Ok(([Some(*only), None, None], false)),
        [] => Err(recording.lacks("acceleration channel ax, ay or az")),
        [first, ..] => {
            let unit = match first.quantity {
                Quantity::Voltage => "10 mV/g",
                _ => "g",
            };
            Err(recording.lacks(format!(
                "acceleration channel ax, ay or az, and it has several of unknown quantity; --map \"{name}=ax:{unit}\", or name = \"ax\" under {} \
                 in the sidecar, says which",
                channel_section(&first.name),
                name = first.name,
            )))
        }
    }
}

/// Acceleration per sensor count, m/s² (without `is_calibrated`: in the unit of the channel), such that the largest
/// absolute sample `largest` fits into the 16 bits of the device.
fn count(largest: f64, is_calibrated: bool) -> f64 {
    let needed = largest / FULL_SCALE;
    if needed <= 0.0 {
        return COUNT[0];
    }
    if is_calibrated {
        // For acceleration beyond ±16 g, the largest range of the sensor, the scale follows the largest sample.
        COUNT.into_iter().find(|&count| count >= needed).unwrap_or(needed)
    } else {
        needed
    }
}

/// Number of teeth of the tool: given by the user, else from the sidecar.
fn teeth(recording: &Recording, speed: SpindleSettings) -> Result<u8, RecordingError> {
    let recorded = recording.sidecar.cut.and_then(|cut| cut.teeth);
    match (speed.teeth, recorded) {
        (Some(teeth), _) => Ok(teeth),
        (None, Some(teeth)) => u8::try_from(teeth).map_err(|_| RecordingError::Content {
            path: super::Sidecar::path_of(&recording.path),
            what: format!("cut.teeth = {teeth}: at most 255 is possible"),
        }),
        (None, None) => Err(recording.lacks("number of teeth (--teeth, or cut.teeth beside the recording)")),
    }
}

/// Tachometer wheel (mark positions and missing marks) from the sidecar, by default one position with its mark; `None`
/// if the recording has no channel `tacho`.
pub(super) fn wheel(recording: &Recording) -> Option<Wheel> {
    recording.channel("tacho")?;
    let said = recording
        .sidecar
        .channels
        .values()
        .find(|channel| channel.name.as_deref() == Some("tacho"))
        .or_else(|| recording.sidecar.channels.get("tacho"));
    Some(Wheel {
        positions: said.and_then(|channel| channel.pulses_per_rev).unwrap_or(1),
        missing: said.and_then(|channel| channel.missing).unwrap_or(0),
    })
}

/// Working point (axial depth, immersion angles, feed) from the sidecar; `None` if one of these parameters of the cut
/// is missing.
fn working_point(recording: &Recording) -> Option<WorkingPoint> {
    let cut = recording.sidecar.cut?;
    Some(WorkingPoint {
        axial_depth: Millimeters(cut.axial_depth_mm? as f32),
        start: Degrees(cut.start_deg? as f32),
        exit: Degrees(cut.exit_deg? as f32),
        feed_per_tooth: Millimeters(cut.feed_per_tooth_mm? as f32),
        posture: 0,
    })
}

/// Time stamp of a sample index (fractions allowed), ns, on the device clock, which starts at 0 with the first sample.
fn stamp(sample: f64, rate: f64) -> Nanoseconds {
    Nanoseconds((sample / rate * 1e9).round().max(0.0) as u64)
}

/// Quantizes the acceleration channels (`count` m/s² per count, `rate` samples per second) into blocks; a missing axis
/// is 0.
fn blocks(axes: &[Option<&Channel>; 3], count: f64, rate: f64) -> Vec<Block> {
    let length = axes
        .iter()
        .flatten()
        .map(|channel| channel.samples.len())
        .max()
        .unwrap_or(0);
    let sample = |index: usize| -> Counts {
        axes.map(|channel| {
            let value = channel.map_or(0.0, |channel| channel.samples[index]);
            // The cast to 16 bits saturates at −32 768 and 32 767, as the sensor does.
            (value / count).round() as i16
        })
    };
    (0..length)
        .step_by(MAX_BLOCK_SAMPLES)
        .enumerate()
        .map(|(sequence, first)| {
            let mut block = Block {
                sequence: sequence as u32,
                time: stamp(first as f64, rate),
                counts: (first..length.min(first + MAX_BLOCK_SAMPLES))
                    .map(sample)
                    .collect(),
                ..Block::default()
            };
            block.clipped = block.counts.iter().filter(|&&counts| is_clipped(counts)).count() as u16;
            block
        })
        .collect()
}

/// Rising edges of the tachometer channel `tacho` as the device detects them, in order; empty without this channel.
fn edges(recording: &Recording) -> Vec<Edge> {
    let level = recording.channel("tacho").map(|tacho| tacho.samples.as_slice());
    rises(level.unwrap_or_default())
        .map(|rise| Edge {
            time: stamp(
                rise.sample as f64 - f64::from(rise.before),
                recording.sample_rate_hz,
            ),
        })
        .collect()
}

/// A rising edge of the tachometer level, as the device detects it.
pub(super) struct Rise {
    /// Index of the sample at which the edge detector of the device reports the rising edge.
    pub(super) sample: usize,
    /// Time from the rising edge to the sample at which it is reported, in sample intervals.
    before: f32,
}

/// Rising edges of a tachometer level, sampled as `level`, in order, as the edge detector of the device finds them.
pub(super) fn rises(level: &[f64]) -> impl Iterator<Item = Rise> {
    let (low, high) = level
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &level| {
            (low.min(level), high.max(level))
        });
    let detector = LevelDetector {
        least_swing: (LEAST_SWING * (high - low)).max(f64::from(f32::MIN_POSITIVE)) as f32,
    };
    let mut state = LevelDetectorState::default();
    level.iter().enumerate().filter_map(move |(sample, &level)| {
        let before = detector.step(&mut state, level as f32)?;
        Some(Rise { sample, before })
    })
}
