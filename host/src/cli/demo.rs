//! `quietcut demo`: lobes, table upload, cut, chatter detection and advice on a virtual robot cell.

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

/// Runs the whole chain on a virtual robot cell without hardware: lobes, upload, cut, chatter, advice, quiet cut.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  quietcut demo --out quietcut-demo")]
pub struct Args {
    /// Folder where the report and the lobe table are written.
    #[arg(long, value_name = "DIR", default_value = "quietcut-demo")]
    out: PathBuf,
    #[command(flatten)]
    output: Output,
}

/// Cuts of the demonstration, as spindle speed in rev/min and axial depth in mm. They are a choice: the table of the
/// virtual cell predicts chatter at both.
const CUTS: [(f64, f64); 2] = [(1045.0, 2.0), (900.0, 2.0)];

/// Lowest and highest spindle speed of the lobe table, rev/min: a choice that contains both cuts and their advised
/// speeds.
const TABLE_RPM: (f64, f64) = (600.0, 2400.0);
/// Largest axial depth of the lobe table, mm: a choice, three times the depth of the cuts.
const TABLE_DEPTH_MM: f64 = 6.0;

const TITLE: &str = "quietcut demo: a milling robot, chatter, and the quiet speed";

#[derive(Serialize)]
struct DemoOutput {
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
    /// First report in which the device detects chatter during one cut of the demonstration; `null` if it detects none.
    alarm: Option<VerdictAnswer>,
    /// Last verdict of the device on one cut of the demonstration, before the tool begins to leave the workpiece;
    /// `null` if there is none.
    verdict: Option<&'static str>,
    /// Standard deviation of the acceleration in one cut of the demonstration along x, y and z over the last quarter
    /// of full engagement, m/s².
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
        "A milling robot with a two-tooth cutter in a block of acetal. Lobes, cuts and sensor are computed\n\
         now. The device runs the same program as the real board, behind a serial line.\n",
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
    let answer = DemoOutput {
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
    check(&stories)
}

/// Computes the lobe table of the virtual cell and prints its lowest stability limit.
fn lobes(cell: &VirtualCell, output: Output) -> Result<Vec<u8>, Error> {
    let began = Instant::now();
    let request = TableRequest {
        rpm: Some(TABLE_RPM),
        depth_mm: Some(TABLE_DEPTH_MM),
        ..TableRequest::default()
    };
    let bytes = build_table(std::slice::from_ref(cell.case()), &request)?.bytes;
    let table = LobeTable::parse(&bytes).map_err(Error::other)?;
    let (limit, speeds) = (lowest_limit(&table), table.speeds().len());
    let seconds = began.elapsed().as_secs_f64();
    output.line(format!(
        "1  Lobes   {limit}\n           {speeds} speeds in {seconds:.1} s"
    ))?;
    Ok(bytes)
}

/// Starts the simulated device and sends the lobe table of the virtual cell to it.
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

/// Sentence about the lowest stability limit in the first layer of a lobe table: depth, spindle speed and kind of
/// stability loss.
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

/// Makes one cut of the demonstration and, if the device advises another speed or depth, a second cut as advised.
fn story(
    bench: &mut Bench,
    cell: &VirtualCell,
    rpm: f64,
    depth_mm: f64,
    output: Output,
) -> Result<Story, Error> {
    set_working_point(bench, cell, depth_mm, output)?;
    let first = bench.cut(rpm, depth_mm)?;
    print_events(&first, output)?;
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
    output.line(format!("   Advised {rpm:.0} rev/min, {depth_mm:.2} mm deep"))?;
    set_working_point(bench, cell, depth_mm, output)?;
    let advised = bench.cut(rpm, depth_mm)?;
    print_events(&advised, output)?;
    if advised.is_quiet() {
        let (before, after) = (largest_vibration(&first), largest_vibration(&advised));
        output.line(format!(
            "   Result  {before:.2} m/s² before, {after:.2} m/s² now; the remaining vibration is synchronous with the tooth passing"
        ))?;
    }
    Ok(Story {
        first,
        advised: Some(advised),
    })
}

fn set_working_point(
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
        "           working point set on the device: {}",
        WorkingPointAnswer::new(&point)
    ))
}

/// Prints the events of one cut for a machinist: engagement, chatter, advice, vibration.
fn print_events(trial: &Trial, output: Output) -> Result<(), Error> {
    let event = |t_s: f64, text: &str| output.line(format!("{t_s:9.2} s {text}"));
    event(trial.full_cut_s[0], "the tool is fully engaged")?;
    match trial.alarm() {
        Some(report) => {
            let teeth = trial.teeth_since_entry(seconds(report));
            event(
                seconds(report),
                &format!("{} (tooth pass {teeth:.0})", words::verdict(&report.judgement)),
            )?;
            if let Some(advice) = &report.advice {
                output.line(format!("           advice: {}", words::action(advice)))?;
                output.line(format!(
                    "           reason: {}",
                    words::why(advice, &report.judgement, report.speed)
                ))?;
            }
        }
        None => event(
            trial.full_cut_s[1],
            "the tool leaves; the device reported no chatter: QUIET",
        )?,
    }
    output.line(format!(
        "           vibration at the end of the cut: {:.2} m/s² rms",
        largest_vibration(trial)
    ))
}

/// Standard deviation of the acceleration over the last quarter of full engagement, m/s², along the axis with the
/// largest value.
fn largest_vibration(trial: &Trial) -> f64 {
    trial.vibration().into_iter().fold(0.0, f64::max)
}

/// Checks the result of the demonstration.
///
/// # Errors
/// The device did not detect chatter in a first cut, advised no other speed or depth, or reports chatter in the
/// advised cut.
fn check(stories: &[Story]) -> Result<(), Error> {
    for Story { first, advised } in stories {
        let cut = format!("{:.0} rev/min, {:.2} mm", first.rpm, first.depth_mm);
        if first.is_quiet() {
            return Err(Error::other(format!(
                "the device detected no chatter at {cut}, although this cut is unstable"
            )));
        }
        match advised {
            None => return Err(Error::other(format!("the device had no advice for {cut}"))),
            Some(advised) if !advised.is_quiet() => {
                return Err(Error::other(format!(
                    "the advice for {cut} was {:.0} rev/min, {:.2} mm, and the device reports chatter there too",
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
        // The user gives the demonstration no input that could cause an error of its test bench, so the exit status is
        // 1.
        Self::other(error)
    }
}
