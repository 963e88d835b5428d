//! `quietcut table`: builds the lobe table that goes to the device, or shows one.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use quietcut_core::lobes::{Kind, LobeTable};
use serde::Serialize;

use super::{Error, Output, Range};
use crate::case::Case;
use crate::file;
use crate::stability::{TableRequest, build_table};

/// Builds a lobe table for the device from cases, or shows one.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  quietcut table tests/cases/kuka-kr90-acetal.toml --out kuka.qct\n  quietcut table --show kuka.qct"
)]
pub struct Args {
    /// The case files, one layer each.
    #[arg(value_name = "CASE", required_unless_present = "show", requires = "out")]
    cases: Vec<PathBuf>,
    /// The table to write.
    #[arg(long, value_name = "FILE.qct", requires = "cases")]
    out: Option<PathBuf>,
    /// Spindle speeds in rev/min, first:last:count; only the ends matter, the speeds between are chosen where limits
    /// bend. Default: the limits of the machine, else the range of the lobes.
    #[arg(long, value_name = "R", value_parser = Range::positive, requires = "cases")]
    rpm: Option<Range>,
    /// The largest axial depth in mm. Default: four times the lowest limit.
    #[arg(long, value_name = "MM", value_parser = super::positive, allow_negative_numbers = true, requires = "cases")]
    depth_mm: Option<f64>,
    /// Feeds per tooth in mm, one layer each, where limits depend on the feed; separated by commas.
    #[arg(long, value_name = "MM", value_parser = super::positive, value_delimiter = ',', requires = "cases")]
    feed: Vec<f64>,
    /// A table to read back.
    #[arg(long, value_name = "FILE.qct", conflicts_with_all = ["cases", "out"])]
    show: Option<PathBuf>,
    #[command(flatten)]
    output: Output,
}

#[derive(Serialize)]
struct Shown {
    name: String,
    teeth: u8,
    bytes: usize,
    generation: u32,
    crc: String,
    rpm_limits: Option<[f32; 2]>,
    depth_mm: [f32; 2],
    layers: Vec<ShownLayer>,
}

#[derive(Serialize)]
struct ShownLayer {
    feed_per_tooth_mm: [f32; 2],
    start_deg: f32,
    exit_deg: f32,
    posture: u8,
    speeds: Vec<ShownColumn>,
}

#[derive(Serialize)]
struct ShownColumn {
    rpm: f32,
    unstable: Vec<ShownInterval>,
}

#[derive(Serialize)]
struct ShownInterval {
    from_mm: f32,
    to_mm: f32,
    kind: &'static str,
    chatter_hz: f32,
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    if let Some(path) = &args.show {
        let bytes = file::read(path)?;
        return show(path, &bytes, args.output);
    }
    let Some(out) = &args.out else {
        return Err(Error::input("--out FILE.qct says where the table goes"));
    };
    let cases = args
        .cases
        .iter()
        .map(Case::read)
        .collect::<Result<Vec<_>, _>>()
        .map_err(Error::input)?;
    let request = TableRequest {
        rpm: args
            .rpm
            .map(|rpm| (rpm.first().min(rpm.last()), rpm.first().max(rpm.last()))),
        depth_mm: args.depth_mm,
        feeds_per_tooth_mm: args.feed,
    };
    if let Some((first, last)) = request.rpm
        && first == last
    {
        return Err(Error::input(format!(
            "--rpm {first}: a table needs a range of speeds, first:last:count"
        )));
    }
    let bytes = build_table(&cases, &request)?;
    file::write(out, &bytes)?;
    show(out, &bytes, args.output)
}

fn show(path: &Path, bytes: &[u8], output: Output) -> Result<(), Error> {
    let wrong = |error| Error::input(format!("{}: this is no lobe table: {error}", path.display()));
    let table = LobeTable::parse(bytes).map_err(wrong)?;
    let header = table.header().map_err(wrong)?;
    let (from, to) = table.depths();
    let layers = table
        .layers()
        .enumerate()
        .map(|(index, validity)| ShownLayer {
            feed_per_tooth_mm: [validity.feed_from.0, validity.feed_to.0],
            start_deg: validity.start.0,
            exit_deg: validity.exit.0,
            posture: validity.posture,
            speeds: columns(&table, index),
        })
        .collect();
    let shown = Shown {
        name: table.name().into(),
        teeth: table.teeth(),
        bytes: bytes.len(),
        generation: header.generation,
        crc: format!("{:08x}", header.crc),
        rpm_limits: table.limits().map(|limits| [limits.rpm_min.0, limits.rpm_max.0]),
        depth_mm: [from.0, to.0],
        layers,
    };
    let text = as_text(path, &shown);
    output.answer(&shown, text)
}

fn columns(table: &LobeTable<'_>, layer: usize) -> Vec<ShownColumn> {
    table
        .speeds()
        .enumerate()
        .map(|(index, rpm)| ShownColumn {
            rpm: rpm.0,
            unstable: table.entry(layer, index).map_or_else(Vec::new, |column| {
                column
                    .intervals()
                    .iter()
                    .map(|interval| ShownInterval {
                        from_mm: interval.from.0,
                        to_mm: interval.to.0,
                        kind: kind_name(interval.kind),
                        chatter_hz: interval.chatter.0,
                    })
                    .collect()
            }),
        })
        .collect()
}

fn kind_name(kind: Kind) -> &'static str {
    match kind {
        Kind::Hopf => "hopf",
        Kind::Flip => "flip",
        Kind::Fold => "fold",
        Kind::Undecided => "undecided",
    }
}

fn as_text(path: &Path, shown: &Shown) -> String {
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
