//! Recordings in, receptances with their quality out.

use std::ops::Range;
use std::path::Path;

use num_complex::Complex64;

use super::cross_spectra::{CrossSpectra, Segments, averaged, smoothed};
use super::driven::Driven;
use super::estimate::{self, DEPENDENT, Estimator, Line, Shape};
use super::hammer::{self, Blow, HammerWindows};
use super::step_sine::{self, Level};
use super::window::{Window, fast_length};
use super::{Frf, FrfError, FrfTable};
use quietcut_model::structure::Direction;
use quietcut_recording::{Kind, Recording, Sidecar};

/// How the structure was driven, which decides how a record is cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Excitation {
    /// Noise, or a cut: overlapping segments under a window (Welch's method).
    Random,
    /// A frequency that glides: the whole record at once, neighbouring frequencies averaged.
    Sweep,
    /// Blows of a hammer: a segment for each.
    Hammer,
    /// One frequency after the other: phasors of each.
    StepSine,
}

impl Excitation {
    /// What a test is driven by.
    pub(super) fn of(sidecar: &Sidecar) -> Self {
        let glides = sidecar.cut.is_some_and(|cut| cut.last_rpm.is_some());
        match sidecar.kind {
            Some(Kind::Cutting) if glides => Self::Sweep,
            Some(Kind::Hammer) => Self::Hammer,
            Some(Kind::StepSine) => Self::StepSine,
            Some(Kind::Sweep) => Self::Sweep,
            Some(Kind::Shaker | Kind::Cutting | Kind::Idle | Kind::FreeDecay) | None => Self::Random,
        }
    }

    /// The word for people and scripts.
    pub fn name(self) -> &'static str {
        match self {
            Self::Random => "random",
            Self::Sweep => "sweep",
            Self::Hammer => "hammer",
            Self::StepSine => "step-sine",
        }
    }
}

/// How to measure.
#[derive(Clone, Debug)]
pub struct MeasurementSettings {
    /// How it was driven; by the kind of each recording where it is not given.
    pub excitation: Option<Excitation>,
    /// How spectra become an FRF.
    pub estimator: Estimator,
    /// Distance of the frequencies, Hz. Where it is not given: for random excitation eight half-overlapping segments
    /// for each force, for sweeps eight frequencies averaged for each force.
    pub resolution_hz: Option<f64>,
    /// Part by which segments overlap.
    pub overlap: f64,
    /// Window of the segments of random excitation.
    pub window: Window,
    /// First and last frequency, Hz; all where it is not given.
    pub band_hz: Option<(f64, f64)>,
    /// Names of channels where not all are meant.
    pub channels: Vec<String>,
    /// Windows of hammer blows.
    pub hammer: HammerWindows,
    /// The force that is meant, N, where a step-sine test has several levels.
    pub force_n: Option<f64>,
}

impl Default for MeasurementSettings {
    fn default() -> Self {
        Self {
            excitation: None,
            estimator: Estimator::H1,
            resolution_hz: None,
            overlap: 0.5,
            window: Window::Hann,
            band_hz: None,
            channels: Vec::new(),
            hammer: HammerWindows::default(),
            force_n: None,
        }
    }
}

/// What came out.
#[derive(Clone, Debug)]
pub struct Measurement {
    /// The receptances. With several forces their coherence is the multiple one of the response.
    pub table: FrfTable,
    /// Standard deviation of |H| of each entry of the table at each frequency, m/N.
    pub deviation: Vec<Vec<f64>>,
    /// What was measured together.
    pub parts: Vec<Part>,
    /// What whoever uses it should know.
    pub warnings: Vec<String>,
}

/// Recordings that were evaluated together.
#[derive(Clone, Debug)]
pub struct Part {
    /// Number of recordings.
    pub recordings: usize,
    /// Directions of the forces.
    pub forces: Vec<Direction>,
    /// How they drove.
    pub excitation: Excitation,
    /// Independent averages.
    pub averages: f64,
    /// Frequencies at which forces were not independent, which are left out.
    pub left_out_hz: Vec<f64>,
    /// Smallest of the singular values of the forces over all frequencies that are left, each force divided by its
    /// root mean square; 1 for one force.
    pub least_singular: f64,
    /// The blows that were used, and those that were double.
    pub blows: Option<(Vec<Blow>, Vec<Blow>)>,
}

/// One part at its frequencies: a column for each response and force.
struct Measured {
    part: Part,
    frequency_hz: Vec<f64>,
    entries: Vec<(Frf, Vec<f64>)>,
    warnings: Vec<String>,
}

/// Receptances from recordings.
///
/// Recordings of the same forces are averaged; those of other forces add columns. Accelerations and velocities become
/// displacements by division by (iω)² and iω; 0 Hz is left out.
///
/// # Errors
/// No force or response, forces that are not independent, records too short for the resolution, recordings that do
/// not fit together.
pub fn measure(recordings: &[Recording], settings: &MeasurementSettings) -> Result<Measurement, FrfError> {
    let driven = recordings
        .iter()
        .map(|recording| Driven::of(recording, &settings.channels))
        .collect::<Result<Vec<_>, _>>()?;
    let mut groups: Vec<(Excitation, Vec<Driven<'_>>)> = Vec::new();
    for driven in driven {
        let excitation = settings
            .excitation
            .unwrap_or_else(|| Excitation::of(&driven.recording.sidecar));
        let same = groups.iter_mut().find(|(other, members)| {
            members[0].force_directions() == driven.force_directions()
                && members[0].response_kinds() == driven.response_kinds()
                && *other == excitation
        });
        match same {
            Some((_, members)) => members.push(driven),
            None => groups.push((excitation, vec![driven])),
        }
    }
    let measured = groups
        .iter()
        .map(|(excitation, members)| part(*excitation, members, settings))
        .collect::<Result<Vec<_>, _>>()?;
    let path = recordings
        .first()
        .map_or(Path::new(""), |recording| &recording.path);
    merged(path, measured)
}

/// All parts at the frequencies that they have in common.
fn merged(path: &Path, measured: Vec<Measured>) -> Result<Measurement, FrfError> {
    let refused = |what: String| FrfError::Content {
        path: path.into(),
        what,
    };
    let mut common: Vec<f64> = measured
        .first()
        .map_or(Vec::new(), |first| first.frequency_hz.clone());
    let near = |list: &[f64], hertz: f64| {
        let at = list.partition_point(|&f| f < hertz * (1.0 - 1e-9));
        list.get(at)
            .is_some_and(|&f| f <= hertz * (1.0 + 1e-9))
            .then_some(at)
    };
    let most = measured
        .iter()
        .map(|part| part.frequency_hz.len())
        .max()
        .unwrap_or(0);
    for part in &measured {
        common.retain(|&hertz| near(&part.frequency_hz, hertz).is_some());
    }
    if common.len() * 2 < most || common.is_empty() {
        return Err(refused(format!(
            "of {most} frequencies the recordings have {} in common; take the same resolution and rate for all",
            common.len()
        )));
    }
    let mut measurement = Measurement {
        // Filled below: a table cannot be empty.
        table: FrfTable::new(path, vec![0.0], vec![placeholder()])?,
        deviation: Vec::new(),
        parts: Vec::new(),
        warnings: Vec::new(),
    };
    let mut entries: Vec<Frf> = Vec::new();
    for part in measured {
        let lines: Vec<usize> = common
            .iter()
            .filter_map(|&hertz| near(&part.frequency_hz, hertz))
            .collect();
        for (entry, deviation) in part.entries {
            if let Some(twice) = entries.iter().find(|other| other.name() == entry.name()) {
                return Err(refused(format!(
                    "h{} comes from two kinds of recordings; measure them one by one",
                    twice.name()
                )));
            }
            entries.push(Frf {
                receptance: lines.iter().map(|&line| entry.receptance[line]).collect(),
                coherence: entry
                    .coherence
                    .map(|all| lines.iter().map(|&line| all[line]).collect()),
                ..entry
            });
            measurement
                .deviation
                .push(lines.iter().map(|&line| deviation[line]).collect());
        }
        measurement.parts.push(part.part);
        measurement.warnings.extend(part.warnings);
    }
    measurement.table = FrfTable::new(path, common, entries)?;
    Ok(measurement)
}

fn placeholder() -> Frf {
    Frf {
        response: Direction::X,
        force: Direction::X,
        receptance: vec![Complex64::ZERO],
        coherence: None,
    }
}

fn part(
    excitation: Excitation,
    members: &[Driven<'_>],
    settings: &MeasurementSettings,
) -> Result<Measured, FrfError> {
    let first = &members[0];
    let rate = first.recording.sample_rate_hz;
    let refused = |what: String| FrfError::Content {
        path: first.recording.path.clone(),
        what,
    };
    if let Some(other) = members
        .iter()
        .find(|other| other.recording.sample_rate_hz != rate)
    {
        return Err(refused(format!(
            "{rate} Hz, but {} has {} Hz; recordings that are averaged must have one rate",
            other.recording.path.display(),
            other.recording.sample_rate_hz
        )));
    }
    let mut part = Part {
        recordings: members.len(),
        forces: first.force_directions(),
        excitation,
        averages: 0.0,
        left_out_hz: Vec::new(),
        least_singular: 1.0,
        blows: None,
    };
    let mut warnings: Vec<String> = members
        .iter()
        .flat_map(|driven| driven.warnings.clone())
        .collect();
    if excitation == Excitation::StepSine {
        return stepped(part, members, settings, warnings);
    }
    let shape = Shape {
        forces: first.forces.len(),
        responses: first.responses.len(),
    };
    let two_sided = matches!(settings.estimator, Estimator::H2 | Estimator::Mean);
    if two_sided && shape.forces > 1 && shape.forces != shape.responses {
        return Err(refused(format!(
            "H2 of {} forces needs as many responses, but there are {}; take H1",
            shape.forces, shape.responses
        )));
    }
    let spectra = match excitation {
        Excitation::Hammer => struck(&mut part, members, settings, &mut warnings)?,
        _ => members
            .iter()
            .map(|driven| steady(excitation, driven, members, settings))
            .collect::<Result<Vec<_>, _>>()?,
    };
    part.averages = spectra.iter().map(|test| test.averages).sum();
    if part.averages < shape.forces as f64 + 0.5 && excitation != Excitation::Hammer {
        return Err(refused(format!(
            "{:.1} independent averages for {} forces; a longer record or a coarser resolution is needed",
            part.averages, shape.forces
        )));
    }
    let mut lines = estimate::lines(&spectra, shape, settings.estimator);
    if excitation == Excitation::Sweep {
        keep_driven(&mut lines, &spectra, shape);
    }
    independent(&mut lines, &mut part, shape).map_err(refused)?;
    Ok(receptances(part, &lines, first, warnings))
}

/// Spectra of a record that goes on, at the lines of the band.
fn steady(
    excitation: Excitation,
    driven: &Driven<'_>,
    members: &[Driven<'_>],
    settings: &MeasurementSettings,
) -> Result<CrossSpectra, FrfError> {
    let rate = driven.recording.sample_rate_hz;
    let samples = members
        .iter()
        .map(|member| member.recording.len())
        .min()
        .unwrap_or(0);
    let forces = driven.forces.len();
    let too_short = |needed: usize| FrfError::Content {
        path: driven.recording.path.clone(),
        what: format!(
            "{samples} samples ({:.3} s), but a resolution of {} Hz needs {needed}",
            samples as f64 / rate,
            settings.resolution_hz.unwrap_or_default()
        ),
    };
    if excitation == Excitation::Sweep {
        let length = fast_length(driven.recording.len());
        let width = match settings.resolution_hz {
            Some(hertz) => (hertz * length as f64 / rate).round() as usize,
            None => LINES_PER_FORCE * forces,
        };
        if width == 0 {
            return Err(too_short((rate / settings.resolution_hz.unwrap_or(1.0)) as usize));
        }
        let band = band(settings, rate, length);
        return Ok(smoothed(&driven.signals(), rate, TAPER, width, band));
    }
    let length = match settings.resolution_hz {
        Some(hertz) => (rate / hertz).round() as usize,
        None => 2 * samples / (SEGMENTS_PER_FORCE * forces + 1),
    };
    let length = fast_length(length);
    if length > samples || length < 16 {
        return Err(too_short(length));
    }
    let segments = Segments::overlapping(
        settings.window.weights(length),
        settings.overlap,
        driven.recording.len(),
    );
    Ok(averaged(
        &driven.signals(),
        rate,
        &segments,
        band(settings, rate, length),
    ))
}

/// Segments for each force where nothing is asked for.
const SEGMENTS_PER_FORCE: usize = 8;

/// Lines of a whole record that are averaged for each force where nothing is asked for.
const LINES_PER_FORCE: usize = 8;

/// Part of a swept record over which its ends are tapered: what rings on at the ends leaks less.
const TAPER: f64 = 0.01;

/// Lines of a transform within the band; never 0 Hz.
fn band(settings: &MeasurementSettings, rate: f64, length: usize) -> Range<usize> {
    let line = |hertz: f64| hertz * length as f64 / rate;
    match settings.band_hz {
        Some((first, last)) => {
            (line(first).ceil().max(1.0) as usize)..(line(last).floor().max(0.0) as usize + 1)
        }
        None => 1..length / 2,
    }
}

/// Spectra of blows.
fn struck(
    part: &mut Part,
    members: &[Driven<'_>],
    settings: &MeasurementSettings,
    warnings: &mut Vec<String>,
) -> Result<Vec<CrossSpectra>, FrfError> {
    let mut windows = settings.hammer;
    if windows.segment_s.is_none() {
        windows.segment_s = settings.resolution_hz.map(|hertz| 1.0 / hertz);
    }
    let mut cuts = members
        .iter()
        .map(|driven| hammer::segments(driven, windows))
        .collect::<Result<Vec<_>, _>>()?;
    let rate = members[0].recording.sample_rate_hz;
    let length = cuts.iter().map(|cut| cut.length).min().unwrap_or(0);
    if cuts.iter().any(|cut| cut.length != length) {
        // All records at the lines of the one with the shortest segments.
        windows.segment_s = Some(length as f64 / rate);
        cuts = members
            .iter()
            .map(|driven| hammer::segments(driven, windows))
            .collect::<Result<Vec<_>, _>>()?;
    }
    let (mut used, mut double) = (Vec::new(), Vec::new());
    let mut left_over = 0.0_f64;
    let spectra = cuts
        .into_iter()
        .map(|cut| {
            let segments = Segments {
                weights: vec![1.0; cut.length],
                starts: (0..cut.used.len()).map(|blow| blow * cut.length).collect(),
                without_mean: false,
                averages: cut.used.len() as f64,
            };
            let signals: Vec<&[f64]> = cut.signals.iter().map(Vec::as_slice).collect();
            let spectra = averaged(&signals, rate, &segments, band(settings, rate, cut.length));
            used.extend(cut.used);
            double.extend(cut.double);
            left_over = left_over.max(cut.left_over);
            spectra
        })
        .collect();
    if !double.is_empty() {
        let times: Vec<String> = double
            .iter()
            .map(|blow: &Blow| format!("{:.3}", blow.time_s))
            .collect();
        warnings.push(format!("double blows are left out: at {} s", times.join(", ")));
    }
    if used.len() < 3 {
        warnings.push(format!("{} blows: coherence and errors say little", used.len()));
    }
    if left_over > LEFT_OVER {
        warnings.push(format!(
            "the response still is {:.0} % of its peak where segments end, which biases resonances; longer segments or an exponential window help",
            100.0 * left_over
        ));
    }
    if let Some(tau) = windows.exponential_s {
        warnings.push(format!(
            "the exponential window adds {:.4} 1/s to the decay of every mode: take 1/(τω) off identified damping ratios",
            1.0 / tau
        ));
    }
    part.blows = Some((used, double));
    Ok(spectra)
}

/// Part of the peak that may be left where segments end: twice as much, as a part of a resonance, is its bias.
const LEFT_OVER: f64 = 0.02;

/// One phasor for each step.
fn stepped(
    mut part: Part,
    members: &[Driven<'_>],
    settings: &MeasurementSettings,
    mut warnings: Vec<String>,
) -> Result<Measured, FrfError> {
    let first = &members[0];
    if let [_, second, ..] = members {
        return Err(FrfError::Content {
            path: second.recording.path.clone(),
            what:
                "two step-sine tests of the same force; measure them one by one, as their frequencies differ"
                    .into(),
        });
    }
    let steps = level(first, settings.force_n)?.steps;
    let unsettled: Vec<String> = steps
        .iter()
        .filter(|step| !step.is_settled)
        .map(|step| format!("{:.3}", step.frequency_hz))
        .collect();
    if !unsettled.is_empty() {
        warnings.push(format!(
            "the response had not settled at {} Hz; stay longer at each frequency",
            unsettled.join(", ")
        ));
    }
    let (least, most) = steps
        .iter()
        .fold((f64::INFINITY, 0.0_f64), |(least, most), step| {
            (least.min(step.force_n), most.max(step.force_n))
        });
    if most > SAME_FORCE * least {
        warnings.push(format!(
            "the force goes from {least:.3} to {most:.3} N: the FRF of a nonlinear structure is another for each"
        ));
    }
    let (low, high) = settings.band_hz.unwrap_or((0.0, f64::INFINITY));
    let lines: Vec<Line> = steps
        .iter()
        .filter(|step| (low..=high).contains(&step.frequency_hz))
        .map(|step| {
            let mut line = Line {
                frequency_hz: step.frequency_hz,
                h: super::small_matrix::ZERO,
                coherence: [0.0; 3],
                deviation: [[0.0; 3]; 3],
                singular: (1.0, 1.0),
            };
            for p in 0..step.h.len() {
                line.h[p][0] = step.h[p];
                line.coherence[p] = step.coherence[p];
                line.deviation[p][0] = step.deviation[p];
            }
            line
        })
        .collect();
    part.averages = 1.0;
    Ok(receptances(part, &lines, first, warnings))
}

/// The level of a step-sine test that is meant.
fn level(driven: &Driven<'_>, force_n: Option<f64>) -> Result<Level, FrfError> {
    let mut levels = step_sine::levels(driven)?;
    let all: Vec<String> = levels
        .iter()
        .map(|level| format!("{:.4}", level.force_n))
        .collect();
    let off = |level: &Level, wanted: f64| (level.force_n / wanted).ln().abs();
    let found = match force_n {
        None if levels.len() == 1 => Some(0),
        None => None,
        Some(wanted) => (0..levels.len())
            .min_by(|&a, &b| off(&levels[a], wanted).total_cmp(&off(&levels[b], wanted)))
            .filter(|&index| off(&levels[index], wanted) < SAME_FORCE.ln()),
    };
    match found {
        Some(index) => Ok(levels.swap_remove(index)),
        None => Err(FrfError::Content {
            path: driven.recording.path.clone(),
            what: format!(
                "a step-sine test at {} N; say by --force-n which of these is meant",
                all.join(", ")
            ),
        }),
    }
}

/// Ratio of forces that count as one level.
const SAME_FORCE: f64 = 1.2;

/// Leaves out the lines at which a sweep did not drive.
fn keep_driven(lines: &mut Vec<Line>, spectra: &[CrossSpectra], shape: Shape) {
    let power = |line: usize| -> f64 {
        let forces = (0..shape.forces).map(|force| {
            spectra
                .iter()
                .map(|test| test.at(line, force, force).re)
                .sum::<f64>()
        });
        forces.sum()
    };
    let frequency_hz = spectra.first().map_or(&[][..], |test| &test.frequency_hz);
    let largest = (0..frequency_hz.len()).map(power).fold(0.0, f64::max);
    let is_driven = |line: &Line| {
        let at = frequency_hz.partition_point(|&hertz| hertz < line.frequency_hz);
        at < frequency_hz.len() && power(at) > DRIVEN * largest
    };
    lines.retain(is_driven);
}

/// Part of the largest power of the force below which a sweep is not there: shakers lose up to a hundredth of it at
/// resonances.
const DRIVEN: f64 = 1e-3;

/// Leaves out the lines at which the forces depend on each other.
fn independent(lines: &mut Vec<Line>, part: &mut Part, shape: Shape) -> Result<(), String> {
    let count = lines.len();
    let dependent: Vec<Line> = lines
        .iter()
        .filter(|line| line.singular.0 < DEPENDENT)
        .copied()
        .collect();
    let names: Vec<String> = part
        .forces
        .iter()
        .map(|direction| format!("f{direction}"))
        .collect();
    if count == 0 || dependent.len() * 2 > count {
        let example = dependent.first().map_or_else(String::new, |line| {
            format!(
                " At {:.2} Hz the smallest singular value of the forces is {:.1e}; {DEPENDENT} is needed.",
                line.frequency_hz, line.singular.0
            )
        });
        return Err(format!(
            "{} drive no independent motion at {} of {count} frequencies.{example} Take porous material, tests of other \
             immersions as well, or drive one direction at a time",
            names.join(", "),
            dependent.len()
        ));
    }
    lines.retain(|line| line.singular.0 >= DEPENDENT);
    part.left_out_hz = dependent.iter().map(|line| line.frequency_hz).collect();
    if shape.forces > 1 {
        part.least_singular = lines
            .iter()
            .map(|line| line.singular.0)
            .fold(f64::INFINITY, f64::min);
    }
    Ok(())
}

/// Columns in m/N.
fn receptances(part: Part, lines: &[Line], driven: &Driven<'_>, mut warnings: Vec<String>) -> Measured {
    let frequency_hz: Vec<f64> = lines.iter().map(|line| line.frequency_hz).collect();
    if !part.left_out_hz.is_empty() {
        warnings.push(format!(
            "the forces are not independent at {} frequencies, which are left out (the first is {:.3} Hz)",
            part.left_out_hz.len(),
            part.left_out_hz[0]
        ));
    }
    let mut entries = Vec::new();
    for (p, response) in driven.responses.iter().enumerate() {
        for (q, &force) in part.forces.iter().enumerate() {
            let integrated = |line: &Line| {
                Complex64::new(0.0, std::f64::consts::TAU * line.frequency_hz).powi(-response.derivatives)
            };
            let entry = Frf {
                response: response.direction,
                force,
                receptance: lines.iter().map(|line| line.h[p][q] * integrated(line)).collect(),
                coherence: Some(lines.iter().map(|line| line.coherence[p]).collect()),
            };
            let deviation = lines
                .iter()
                .map(|line| line.deviation[p][q] * integrated(line).norm())
                .collect();
            entries.push((entry, deviation));
        }
    }
    Measured {
        part,
        frequency_hz,
        entries,
        warnings,
    }
}

#[cfg(test)]
mod tests;
