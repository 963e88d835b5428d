//! `quietcut demo`: the whole chain on a virtual robot cell.

use std::path::PathBuf;
use std::time::Instant;

use quietcut_core::advice::Action;
use quietcut_core::lobes::LobeTable;
use quietcut_core::units::{Degrees, Millimeters};
use quietcut_core::working_point::WorkingPoint;
use serde::Serialize;

use super::port::WorkingPointAnswer;
use super::{Error, Output};
use crate::demo::{Bench, BenchError, Story, Trial, page};
use crate::device::VirtualCell;
use crate::file;
use crate::lobe_table::{TableRequest, build_table};
use crate::report::answer::VerdictAnswer;
use crate::report::time::seconds;
use crate::report::words;

/// The whole chain on a virtual robot cell, no hardware: lobes, upload, cut, chatter, advice, quiet.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  quietcut demo --out quietcut-demo")]
pub struct Args {
    /// Folder for the report and the lobe table.
    #[arg(long, value_name = "DIR", default_value = "quietcut-demo")]
    out: PathBuf,
    #[command(flatten)]
    output: Output,
}

/// The cuts that are tried: rev/min, mm.
const CUTS: [(f64, f64); 2] = [(1045.0, 2.0), (900.0, 2.0)];

/// Spindle speeds and depths of the lobe table.
const TABLE_RPM: (f64, f64) = (600.0, 2400.0);
const TABLE_DEPTH_MM: f64 = 6.0;

const TITLE: &str = "quietcut demo: a milling robot, chatter, and the quiet speed";

#[derive(Serialize)]
struct Answer {
    report: PathBuf,
    table: PathBuf,
    stories: Vec<StoryAnswer>,
    seconds: f64,
}

#[derive(Serialize)]
struct StoryAnswer {
    first: TrialAnswer,
    advised: Option<TrialAnswer>,
}

#[derive(Serialize)]
struct TrialAnswer {
    rpm: f64,
    depth_mm: f64,
    /// The first call of chatter; `null` where the cut is quiet.
    alarm: Option<VerdictAnswer>,
    /// The last verdict before the tool leaves.
    verdict: Option<&'static str>,
    /// Vibration at the end of the cut along x, y, z, rms.
    vibration_m_per_s2: [f64; 3],
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    let began = Instant::now();
    let output = args.output;
    std::fs::create_dir_all(&args.out).map_err(|cause| {
        Error::input(format!(
            "--out {}: cannot make the folder: {cause}",
            args.out.display()
        ))
    })?;
    output.line(
        "A milling robot with a two-tooth cutter in a block of acetal. Nothing here is recorded: lobes, cuts, sensor and\n\
         device are computed now, and the device is the program of the real one behind a serial line.\n",
    )?;
    let cell = VirtualCell::new().map_err(Error::other)?;
    let bytes = lobes(&cell, output)?;
    let table = LobeTable::parse(&bytes).map_err(Error::other)?;
    let mut bench = switch_on(&cell, &table, output)?;
    let mut stories = Vec::new();
    for (number, (rpm, depth_mm)) in (3..).zip(CUTS) {
        output.line(format!("\n{number}  Cut     {rpm} rev/min, {depth_mm} mm deep"))?;
        stories.push(story(&mut bench, &cell, rpm, depth_mm, output)?);
    }

    let (report, table_file) = (args.out.join("report.html"), args.out.join("lobes.qct"));
    let html = page(TITLE, &table, &stories).map_err(Error::other)?;
    file::write(&table_file, &bytes)?;
    file::write(&report, html.as_bytes())?;
    let answer = Answer {
        stories: stories.iter().map(StoryAnswer::new).collect(),
        seconds: began.elapsed().as_secs_f64(),
        report,
        table: table_file,
    };
    let (number, report, seconds) = (CUTS.len() + 3, answer.report.display(), answer.seconds);
    output.answer(
        &answer,
        format_args!("\n{number}  Report  {report} ({seconds:.0} s in all)"),
    )?;
    judge(&stories)
}

/// Computes the table of the cell.
fn lobes(cell: &VirtualCell, output: Output) -> Result<Vec<u8>, Error> {
    let began = Instant::now();
    let request = TableRequest {
        rpm: Some(TABLE_RPM),
        depth_mm: Some(TABLE_DEPTH_MM),
        ..TableRequest::default()
    };
    let bytes = build_table(std::slice::from_ref(cell.case()), &request)?;
    let table = LobeTable::parse(&bytes).map_err(Error::other)?;
    let (limit, speeds) = (lowest_limit(&table), table.speeds().len());
    let seconds = began.elapsed().as_secs_f64();
    output.line(format!(
        "1  Lobes   {limit}\n           {speeds} speeds in {seconds:.1} s"
    ))?;
    Ok(bytes)
}

/// Switches the device on and gives it the table.
fn switch_on(cell: &VirtualCell, table: &LobeTable<'_>, output: Output) -> Result<Bench, Error> {
    let (mut bench, info) = Bench::new(cell.clone())?;
    let port = bench.serial_port();
    output.line(format!(
        "2  Device  {} with firmware {}, at {port}",
        info.board, info.firmware
    ))?;
    bench.client().upload(table, |_, _| {})?;
    let bytes = table.bytes().len();
    output.line(format!(
        "           lobe table sent over the serial line: {bytes} bytes"
    ))?;
    Ok(bench)
}

/// `at the worst speed, 1045 rev/min, cuts up to 1.33 mm are stable; deeper: …`.
fn lowest_limit(table: &LobeTable<'_>) -> String {
    let limits = table.speeds().enumerate().filter_map(|(index, speed)| {
        let limit = *table.entry(0, index)?.first_limit()?;
        Some((limit.from.0, speed, limit.kind))
    });
    match limits.min_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((depth_mm, speed, kind)) => {
            format!(
                "at the worst speed, {:.0} rev/min, cuts up to {depth_mm:.2} mm are stable; deeper: {}",
                speed.0,
                words::limit(kind)
            )
        }
        None => "all cuts are stable".into(),
    }
}

/// A cut, what the device says of it, and the cut that it says.
fn story(
    bench: &mut Bench,
    cell: &VirtualCell,
    rpm: f64,
    depth_mm: f64,
    output: Output,
) -> Result<Story, Error> {
    tell_working_point(bench, cell, depth_mm, output)?;
    let first = bench.cut(rpm, depth_mm)?;
    account(&first, output)?;
    let advice = first.alarm().and_then(|report| report.advice);
    let target = advice
        .filter(|advice| matches!(advice.action, Action::Speed | Action::Depth))
        .map(|advice| {
            let depth = advice.depth.map_or(depth_mm, |depth| f64::from(depth.0));
            (f64::from(advice.speed.0), depth)
        });
    let Some((rpm, depth_mm)) = target else {
        return Ok(Story { first, advised: None });
    };
    output.line(format!("   As told {rpm:.0} rev/min, {depth_mm:.2} mm deep"))?;
    tell_working_point(bench, cell, depth_mm, output)?;
    let advised = bench.cut(rpm, depth_mm)?;
    account(&advised, output)?;
    if advised.is_quiet() {
        let (before, after) = (loudest(&first), loudest(&advised));
        output.line(format!(
            "   Result  {before:.2} m/s² before, {after:.2} m/s² now; what is left keeps step with the teeth"
        ))?;
    }
    Ok(Story {
        first,
        advised: Some(advised),
    })
}

fn tell_working_point(
    bench: &mut Bench,
    cell: &VirtualCell,
    depth_mm: f64,
    output: Output,
) -> Result<(), Error> {
    let cut = cell.case().cut().map_err(Error::other)?;
    let point = WorkingPoint {
        axial_depth: Millimeters(depth_mm as f32),
        start: Degrees(cut.start_deg as f32),
        exit: Degrees(cut.exit_deg as f32),
        feed_per_tooth: Millimeters(cut.feed_per_tooth_mm as f32),
        posture: 0,
    };
    bench.client().set_working_point(Some(point))?;
    output.line(format!(
        "           the device is told: {}",
        WorkingPointAnswer::new(&point)
    ))
}

/// What happened, in lines for a machinist.
fn account(trial: &Trial, output: Output) -> Result<(), Error> {
    let event = |t_s: f64, text: &str| output.line(format!("{t_s:9.2} s {text}"));
    event(trial.full_cut_s[0], "the tool is in full cut")?;
    match trial.alarm() {
        Some(report) => {
            let teeth = trial.teeth_since_entry(seconds(report));
            event(
                seconds(report),
                &format!("{} (tooth pass {teeth:.0})", words::verdict(&report.judgement)),
            )?;
            if let Some(advice) = &report.advice {
                output.line(format!("           the device says: {}", words::action(advice)))?;
                output.line(format!(
                    "           because: {}",
                    words::why(advice, &report.judgement, report.speed)
                ))?;
            }
        }
        None => event(
            trial.full_cut_s[1],
            "the tool leaves; the device called no chatter: QUIET",
        )?,
    }
    output.line(format!(
        "           vibration at the end of the cut: {:.2} m/s² rms",
        loudest(trial)
    ))
}

/// Vibration at the end of the cut along the axis that has most.
fn loudest(trial: &Trial) -> f64 {
    trial.vibration().into_iter().fold(0.0, f64::max)
}

/// A demonstration whose device did not hear chatter, or whose advice was not quiet, has failed, whatever it printed.
fn judge(stories: &[Story]) -> Result<(), Error> {
    for Story { first, advised } in stories {
        let cut = format!("{:.0} rev/min, {:.2} mm", first.rpm, first.depth_mm);
        if first.is_quiet() {
            return Err(Error::other(format!(
                "the device heard no chatter at {cut}, where there is some"
            )));
        }
        match advised {
            None => return Err(Error::other(format!("the device had no advice for {cut}"))),
            Some(advised) if !advised.is_quiet() => {
                return Err(Error::other(format!(
                    "the advice for {cut} was {:.0} rev/min, {:.2} mm, and the device calls chatter there too",
                    advised.rpm, advised.depth_mm
                )));
            }
            Some(_) => {}
        }
    }
    Ok(())
}

impl StoryAnswer {
    fn new(story: &Story) -> Self {
        Self {
            first: TrialAnswer::new(&story.first),
            advised: story.advised.as_ref().map(TrialAnswer::new),
        }
    }
}

impl TrialAnswer {
    fn new(trial: &Trial) -> Self {
        Self {
            rpm: trial.rpm,
            depth_mm: trial.depth_mm,
            alarm: trial.alarm().map(VerdictAnswer::new),
            verdict: trial
                .last_in_cut()
                .map(|report| words::verdict_key(report.judgement.verdict)),
            vibration_m_per_s2: trial.vibration(),
        }
    }
}

impl From<BenchError> for Error {
    fn from(error: BenchError) -> Self {
        // The user has named nothing that could be wrong.
        Self::other(error)
    }
}
