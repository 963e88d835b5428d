//! `quietcut table`: builds the lobe table of the device from cases, or shows an existing table.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use quietcut_core::lobes::{IntervalKind, IntervalSlopes, LobeTable};
use serde::Serialize;

use super::method::case_after;
use super::{Endings, Error, Output, Range, speed_question};
use crate::case::Case;
use crate::file;
use crate::lobe_table::{TableRequest, build_table};

/// Builds a lobe table for the device from cases, or shows one.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  quietcut table tests/cases/kuka-kr90-acetal.toml --out kuka.qct\n  quietcut table --show kuka.qct"
)]
pub struct Args {
    /// The case files; each becomes one layer of the table.
    #[arg(value_name = "CASE", required_unless_present = "show", requires = "out")]
    cases: Vec<PathBuf>,
    /// Lobe table to write; the ending sets the format: qct for the device, json for a program. May be repeated.
    #[arg(long, value_name = "FILE.qct", value_parser = Endings(&["qct", "json"]).parser(), requires = "cases")]
    out: Vec<PathBuf>,
    /// Spindle speeds in rev/min, first:last or first:last:count. Only the ends are used; the speeds between them are
    /// chosen adaptively. Default: the speed limits of the machine, else the range of the lobes.
    #[arg(long, value_name = "R", value_parser = Range::positive, requires = "cases")]
    rpm: Option<Range>,
    /// Largest axial depth in mm. Default: four times the lowest stability limit.
    #[arg(long, value_name = "MM", value_parser = super::positive, allow_negative_numbers = true, requires = "cases")]
    depth_mm: Option<f64>,
    /// Initial number of spindle speeds in the lobe table; more are added where the limits curve. Default: 121.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(2..=2000), requires = "cases")]
    speeds: Option<u16>,
    /// Feeds per tooth in mm, separated by commas, for cases whose limits depend on the feed. Each becomes a layer;
    /// more layers are added between them where the limits curve.
    #[arg(long, value_name = "MM", value_parser = super::positive, value_delimiter = ',', requires = "cases")]
    feed: Vec<f64>,
    /// Feed directions in degrees from the machine's x towards its y, separated by commas. Each becomes a layer; more
    /// layers are added between them where the limits curve. Default: the feed direction of each case, which the table
    /// does not store.
    #[arg(long, value_name = "DEG", value_parser = super::finite, value_delimiter = ',', allow_negative_numbers = true, requires = "cases")]
    feed_direction_deg: Vec<f64>,
    /// Store the derivatives of each limit with respect to natural frequencies, damping ratios and cutting force, for a
    /// device that updates these parameters.
    #[arg(long, requires = "cases")]
    derivatives: bool,
    /// Store this percentile of the first limit, in percent, instead of the nominal limit. It follows from the standard
    /// deviations of the case (keys that end in _std); the computation takes minutes.
    #[arg(long, value_name = "P", value_parser = percent, requires = "cases")]
    percentile: Option<f64>,
    /// Operating time in s at which drift and wear of the cases are evaluated.
    #[arg(long, value_name = "T", value_parser = super::non_negative, allow_negative_numbers = true, requires = "cases")]
    after_s: Option<f64>,
    /// Lobe table to show.
    #[arg(long, value_name = "FILE.qct", conflicts_with_all = ["cases", "out"])]
    show: Option<PathBuf>,
    #[command(flatten)]
    output: Output,
}

#[derive(Serialize)]
struct TableOutput {
    name: String,
    teeth: u8,
    bytes: usize,
    generation: u32,
    crc: String,
    rpm_limits: Option<[f32; 2]>,
    depth_mm: [f32; 2],
    #[serde(skip_serializing_if = "Option::is_none")]
    interpolation_error: Option<ErrorOutput>,
    layers: Vec<LayerOutput>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    warnings: Vec<String>,
}

/// Bound of the interpolation error of the stability limits between the entries of a lobe table: in axial depth, mm,
/// and in spindle speed, relative to the speed.
#[derive(Serialize)]
struct ErrorOutput {
    depth_mm: f32,
    speed: f32,
}

#[derive(Serialize)]
struct LayerOutput {
    feed_per_tooth_mm: [f32; 2],
    start_deg: f32,
    exit_deg: f32,
    posture: u8,
    #[serde(skip_serializing_if = "Option::is_none")]
    feed_direction_deg: Option<f32>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    modes: Vec<ModeOutput>,
    speeds: Vec<SpeedOutput>,
}

#[derive(Serialize)]
struct ModeOutput {
    frequency_hz: f32,
    damping_ratio: f32,
}

/// Derivatives of both ends of an unstable depth interval of the lobe table, the lower end first, mm per relative
/// change of the parameter. Inner lists are in the order of the modes of the layer.
#[derive(Serialize)]
struct DerivativesOutput {
    by_frequency_mm: [Vec<f32>; 2],
    by_damping_ratio_mm: [Vec<f32>; 2],
    by_cutting_force_mm: [f32; 2],
}

#[derive(Serialize)]
struct SpeedOutput {
    rpm: f32,
    unstable: Vec<UnstableOutput>,
}

#[derive(Serialize)]
struct UnstableOutput {
    from_mm: f32,
    to_mm: f32,
    kind: &'static str,
    chatter_hz: f32,
    #[serde(skip_serializing_if = "Option::is_none")]
    derivatives: Option<DerivativesOutput>,
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    if let Some(path) = &args.show {
        let bytes = file::read(path)?;
        let shown = shown(path, &bytes, Vec::new())?;
        return args.output.answer(&shown, as_text(path, &shown));
    }
    let Some(first) = args.out.first() else {
        return Err(Error::input("--out FILE.qct is needed: the lobe table to write"));
    };
    let mut cases = args
        .cases
        .iter()
        .map(Case::read)
        .collect::<Result<Vec<_>, _>>()
        .map_err(Error::input)?;
    for case in &mut cases {
        speed_question::ask(case, args.output)?;
    }
    if let Some(after_s) = args.after_s {
        for case in &mut cases {
            *case = case_after(case, after_s)?;
        }
    }
    let request = TableRequest {
        rpm: args
            .rpm
            .map(|rpm| (rpm.first().min(rpm.last()), rpm.first().max(rpm.last()))),
        depth_mm: args.depth_mm,
        feeds_per_tooth_mm: args.feed,
        speeds: args.speeds.map(usize::from),
        feed_directions_deg: args.feed_direction_deg,
        derivatives: args.derivatives,
        percentile: args.percentile,
    };
    if let Some((first, last)) = request.rpm
        && first == last
    {
        return Err(Error::input(format!(
            "--rpm {first}: a table needs a range of speeds, first:last:count"
        )));
    }
    let mut built = build_table(&cases, &request)?;
    for case in &cases {
        for sentence in case.assumptions() {
            built
                .warnings
                .push(format!("{}: assumed: {sentence}", case.path.display()));
        }
    }
    for warning in &built.warnings {
        tracing::warn!("{warning}");
    }
    let shown = shown(first, &built.bytes, built.warnings)?;
    for path in &args.out {
        match file::ending(path).as_str() {
            "json" => file::write(
                path,
                serde_json::to_string(&shown).map_err(Error::other)?.as_bytes(),
            )?,
            _ => file::write(path, &built.bytes)?,
        }
    }
    args.output.answer(&shown, as_text(first, &shown))
}

/// Content of the lobe table in `bytes`; `path` names it in messages.
fn shown(path: &Path, bytes: &[u8], warnings: Vec<String>) -> Result<TableOutput, Error> {
    let wrong = |error| Error::input(format!("{}: this is no lobe table: {error}", path.display()));
    let table = LobeTable::parse(bytes).map_err(wrong)?;
    let header = table.header().map_err(wrong)?;
    let (from, to) = table.depths();
    let layers = table
        .layers()
        .enumerate()
        .map(|(index, validity)| LayerOutput {
            feed_per_tooth_mm: [validity.feed_from.0, validity.feed_to.0],
            start_deg: validity.start.0,
            exit_deg: validity.exit.0,
            posture: validity.posture,
            feed_direction_deg: table.feed_direction(index).map(|direction| direction.0),
            modes: table
                .modes(index)
                .map(|mode| ModeOutput {
                    frequency_hz: mode.frequency.0,
                    damping_ratio: mode.damping_ratio,
                })
                .collect(),
            speeds: columns(&table, index),
        })
        .collect();
    Ok(TableOutput {
        name: table.name().into(),
        teeth: table.teeth(),
        bytes: bytes.len(),
        generation: header.generation,
        crc: format!("{:08x}", header.crc),
        rpm_limits: table.limits().map(|limits| [limits.rpm_min.0, limits.rpm_max.0]),
        depth_mm: [from.0, to.0],
        interpolation_error: table.interpolation_error().map(|error| ErrorOutput {
            depth_mm: error.depth.0,
            speed: error.speed,
        }),
        layers,
        warnings,
    })
}

fn columns(table: &LobeTable<'_>, layer: usize) -> Vec<SpeedOutput> {
    table
        .speeds()
        .enumerate()
        .map(|(index, rpm)| SpeedOutput {
            rpm: rpm.0,
            unstable: table.entry(layer, index).map_or_else(Vec::new, |column| {
                let intervals = column.intervals().iter().enumerate();
                intervals
                    .map(|(position, interval)| UnstableOutput {
                        from_mm: interval.from.0,
                        to_mm: interval.to.0,
                        kind: kind_name(interval.kind),
                        chatter_hz: interval.chatter.0,
                        derivatives: table
                            .slopes(layer, index, position)
                            .map(|slopes| shown_slopes(&slopes, table.modes(layer).len())),
                    })
                    .collect()
            }),
        })
        .collect()
}

fn shown_slopes(slopes: &IntervalSlopes, modes: usize) -> DerivativesOutput {
    let ends = [&slopes.from, &slopes.to];
    DerivativesOutput {
        by_frequency_mm: ends.map(|end| end.by_frequency.iter().take(modes).copied().collect()),
        by_damping_ratio_mm: ends.map(|end| end.by_damping_ratio.iter().take(modes).copied().collect()),
        by_cutting_force_mm: ends.map(|end| end.by_cutting_force),
    }
}

/// Parses a percentage between 0 and 100, both excluded.
fn percent(text: &str) -> Result<f64, String> {
    let percent = super::positive(text)?;
    if percent < 100.0 {
        Ok(percent)
    } else {
        Err(format!(
            "`{text}` is not possible: a percentage below 100 is needed"
        ))
    }
}

fn kind_name(kind: IntervalKind) -> &'static str {
    match kind {
        IntervalKind::Hopf => "hopf",
        IntervalKind::Flip => "flip",
        IntervalKind::Fold => "fold",
        IntervalKind::Undecided => "undecided",
        IntervalKind::Bistable => "bistable",
    }
}

fn as_text(path: &Path, shown: &TableOutput) -> String {
    let mut text = format!(
        "{}: {} ({} teeth), {} bytes, generation {}, CRC {}, depth {} to {} mm",
        path.display(),
        shown.name,
        shown.teeth,
        shown.bytes,
        shown.generation,
        shown.crc,
        shown.depth_mm[0],
        shown.depth_mm[1],
    );
    if let Some([slowest, fastest]) = shown.rpm_limits {
        let _ = write!(text, ", machine {slowest} to {fastest} rev/min");
    } else {
        text.push_str(", no speed limits of the machine: advice assumes that every speed is possible");
    }
    if let Some(error) = &shown.interpolation_error {
        let _ = write!(
            text,
            ", interpolation error of stable depths at most {:.4} mm, on the safe side over at most {:.2} % of the speed",
            error.depth_mm,
            100.0 * error.speed
        );
    }
    for (index, layer) in shown.layers.iter().enumerate() {
        let ends = (layer.speeds.first(), layer.speeds.last());
        let (slowest, fastest) = match ends {
            (Some(first), Some(last)) => (first.rpm, last.rpm),
            _ => (0.0, 0.0),
        };
        let intervals: usize = layer.speeds.iter().map(|column| column.unstable.len()).sum();
        let lowest = layer
            .speeds
            .iter()
            .filter_map(|column| Some((column.unstable.first()?, column.rpm)))
            .filter(|(interval, _)| interval.kind != "undecided")
            .min_by(|(a, _), (b, _)| a.from_mm.total_cmp(&b.from_mm));
        // Writing to a String cannot fail.
        let _ = write!(
            text,
            "\nlayer {}: feed {} to {} mm, immersion {} to {} degrees, posture {}: {} speeds from {slowest:.1} to \
             {fastest:.1} rev/min, {intervals} unstable intervals",
            index + 1,
            layer.feed_per_tooth_mm[0],
            layer.feed_per_tooth_mm[1],
            layer.start_deg,
            layer.exit_deg,
            layer.posture,
            layer.speeds.len(),
        );
        if let Some(degrees) = layer.feed_direction_deg {
            let _ = write!(text, ", feed towards {degrees} degrees");
        }
        if !layer.modes.is_empty() {
            let modes: Vec<String> = layer
                .modes
                .iter()
                .map(|mode| format!("{:.2} Hz", mode.frequency_hz))
                .collect();
            let _ = write!(
                text,
                ", with derivatives with respect to cutting force and modes of {}",
                modes.join(", ")
            );
        }
        if let Some((interval, rpm)) = lowest {
            let _ = write!(
                text,
                "; lowest limit {:.3} mm ({}) at {rpm:.1} rev/min",
                interval.from_mm, interval.kind
            );
        }
    }
    text
}
