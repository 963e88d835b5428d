//! `quietcut setup`: a folder and a commented case file for one's own machine, by options, by a file, or by questions.

mod given;
mod known_case;

use std::fs;
use std::io::{self, BufRead, IsTerminal, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::range::non_negative_ends;
use super::{Error, Output, count, positive};
use crate::case::Case;
use crate::file;
use crate::machine::{
    Answers, Immersion, MachineFolder, MaterialAnswer, MaterialRange, NextStep, RANGES, Section, case_text,
    next_step, section_text,
};
use given::Given;
use known_case::missing_sections;

/// Makes the folder of a machine with a commented case file, or adds the missing sections to its case, and says which taps
/// to make.
///
/// Answers come from the options, else from the file of --answers, else from questions on the terminal.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example:\n  quietcut setup mill --teeth 2 --diameter-mm 12.7 --ktc-mpa 119 --krc-mpa 20.2 --kac-mpa 39.3 --down-milling-mm 6.35 --feed-per-tooth-mm 0.15 --rpm 600:2400\n\nThe file of --answers is TOML with the names of the options: teeth = 2, diameter-mm = 12.7, ktc-mpa = 119.0 …"
)]
pub struct Args {
    /// The folder of the machine; it is made if there is none.
    #[arg(value_name = "DIR", required_unless_present = "materials")]
    folder: Option<PathBuf>,
    /// List the classes of materials, the ranges of their coefficients, and the sources.
    #[arg(long)]
    materials: bool,
    /// TOML file with answers.
    #[arg(long, value_name = "FILE")]
    answers: Option<PathBuf>,
    /// Replace the case file in the folder of the machine if there is one. Without this option the sections that the case
    /// lacks are added to it.
    #[arg(long)]
    replace: bool,
    #[command(flatten)]
    given: Given,
    #[command(flatten)]
    output: Output,
}

#[derive(Serialize)]
struct SetupOutput {
    case: PathBuf,
    taps: Vec<&'static str>,
    next: NextStep,
}

#[derive(Serialize)]
struct MaterialsOutput {
    materials: Vec<MaterialOutput>,
}

#[derive(Serialize)]
struct MaterialOutput {
    name: &'static str,
    what: &'static str,
    ktc_mpa: [f64; 2],
    source: &'static str,
}

/// Runs the verb.
pub fn run(args: Args) -> Result<(), Error> {
    let Some(folder) = args.folder.filter(|_| !args.materials) else {
        return list_materials(args.output);
    };
    let path = folder.join("case.toml");
    let known = if path.exists() && !args.replace {
        Some(Case::read(&path)?)
    } else {
        None
    };
    let missing = known.as_ref().map_or(Section::ALL.to_vec(), missing_sections);
    if missing.is_empty() {
        return Err(Error::input(format!(
            "{}: the case exists and is complete; --replace writes it anew, quietcut next {} says what to do with it",
            path.display(),
            folder.display()
        )));
    }
    if let Some(known) = &known {
        args.given.check_missing(known)?;
    }
    let given = match &args.answers {
        Some(file) => args.given.or(answers_of(file)?),
        None => args.given,
    };
    let given = match &known {
        Some(known) => given.known_from(known),
        None => given,
    };
    let ask = io::stdin().is_terminal() && io::stderr().is_terminal();
    let default_name = folder
        .file_name()
        .map_or_else(|| "machine".into(), |name| name.to_string_lossy().into_owned());
    let answers = given.complete(&default_name, ask)?;
    let text = if known.is_some() {
        let before = file::read_text(&path)?;
        format!("{}\n\n{}", before.trim_end(), section_text(&answers, &missing))
    } else {
        case_text(&answers)
    };
    // Parsing the text of the new case refuses impossible values before any file is written.
    Case::parse(&path, &text)?;
    for name in ["taps", "frf", "cuts"] {
        fs::create_dir_all(folder.join(name)).map_err(|error| {
            Error::input(format!(
                "{}: the folder cannot be made: {error}",
                folder.join(name).display()
            ))
        })?;
    }
    file::write(&path, text.as_bytes())?;
    let next = next_step(&MachineFolder::read(&folder)?);
    let text = format!(
        "{}\n\n{TAPS}\nnext: {}\nwhy:  {}",
        path.display(),
        next.command,
        next.why
    );
    let output = SetupOutput {
        case: path,
        taps: vec!["x", "y"],
        next,
    };
    args.output.answer(&output, text)
}

/// Text for the user about the taps to make: number, directions, files and sensor.
const TAPS: &str = "\
Taps: five in x, five in y, saved as taps/x.csv and taps/y.csv (CSV, UFF, MAT, WAV …).

        y (normal to the feed)
        ^
        |      tool seen from the spindle
        |    .-----.
        |    | tip |<==== hammer in x
        |    '-----'
        |       ^
        |     hammer in y
        +-----------------> x (feed)

The spindle stands still. Glue the accelerometer to the tool tip, opposite to the hammer. Let each tap ring out before the next. Sample at ten times the
highest frequency of interest, with an anti-aliasing filter. The direction z is stiff on most machines; on a robot tap it too.
";

fn list_materials(output: Output) -> Result<(), Error> {
    let materials: Vec<MaterialOutput> = RANGES
        .iter()
        .map(|range| MaterialOutput {
            name: range.name,
            what: range.what,
            ktc_mpa: range.ktc_mpa,
            source: range.source,
        })
        .collect();
    let lines: Vec<String> = materials
        .iter()
        .map(|row| {
            let [from, to] = row.ktc_mpa;
            format!(
                "{}: {}; ktc {from} to {to} MPa; {}",
                row.name, row.what, row.source
            )
        })
        .collect();
    output.answer(&MaterialsOutput { materials }, lines.join("\n"))
}

fn answers_of(path: &Path) -> Result<Given, Error> {
    let text = file::read_text(path)?;
    toml::from_str(&text).map_err(|error| Error::input(format!("{}: {error}", path.display())))
}

/// One missing answer of the user: the option that would give it, and the question that the terminal shows.
struct Question {
    option: &'static str,
    question: &'static str,
}

impl Given {
    /// These answers of the user; each that is missing here is taken from `other`. `other` gives no answer about the
    /// material if these answers have its class or its tangential coefficient, and none about the immersion if these
    /// have one.
    fn or(self, other: Self) -> Self {
        let has_material = self.material.is_some() || self.ktc_mpa.is_some();
        let has_cut = self.down_milling_mm.is_some() || self.up_milling_mm.is_some() || self.slot;
        Self {
            name: self.name.or(other.name),
            machine: self.machine.or(other.machine),
            holder: self.holder.or(other.holder),
            sensor: self.sensor.or(other.sensor),
            teeth: self.teeth.or(other.teeth),
            diameter_mm: self.diameter_mm.or(other.diameter_mm),
            edge_angle_deg: self.edge_angle_deg.or(other.edge_angle_deg),
            material: self.material.or(other.material.filter(|_| !has_material)),
            ktc_mpa: self.ktc_mpa.or(other.ktc_mpa.filter(|_| !has_material)),
            krc_mpa: self.krc_mpa.or(other.krc_mpa.filter(|_| !has_material)),
            kac_mpa: self.kac_mpa.or(other.kac_mpa.filter(|_| !has_material)),
            ktc_mpa_std: self.ktc_mpa_std.or(other.ktc_mpa_std.filter(|_| !has_material)),
            down_milling_mm: self
                .down_milling_mm
                .or(other.down_milling_mm.filter(|_| !has_cut)),
            up_milling_mm: self.up_milling_mm.or(other.up_milling_mm.filter(|_| !has_cut)),
            slot: self.slot || (other.slot && !has_cut),
            feed_per_tooth_mm: self.feed_per_tooth_mm.or(other.feed_per_tooth_mm),
            rpm: self.rpm.or(other.rpm),
            power_w: self.power_w.or(other.power_w),
            torque_nm: self.torque_nm.or(other.torque_nm),
        }
    }

    /// Answers of the user with nothing missing. A missing answer without a default is asked for on the terminal if
    /// `ask`; otherwise the error names the options for the missing answers.
    fn complete(mut self, default_name: &str, ask: bool) -> Result<Answers, Error> {
        let missing = self.missing();
        if !missing.is_empty() && !ask {
            let options: Vec<&str> = missing.iter().map(|question| question.option).collect();
            return Err(Error::input(format!(
                "setup needs {}; give these options, a file with --answers, or run it on a terminal, where it asks",
                options.join(", ")
            )));
        }
        for question in missing {
            self.ask(&question)?;
        }
        let wrong = |option: &str| Error::input(format!("{option} is missing"));
        let diameter_mm = self.diameter_mm.ok_or_else(|| wrong("--diameter-mm"))?;
        let rpm = speeds(&self.rpm.clone().ok_or_else(|| wrong("--rpm"))?)?;
        let notes = [
            ("machine", &self.machine),
            ("holder", &self.holder),
            ("sensor", &self.sensor),
        ];
        Ok(Answers {
            notes: notes
                .into_iter()
                .filter_map(|(what, said)| Some((what, said.clone()?)))
                .collect(),
            teeth: self.teeth.ok_or_else(|| wrong("--teeth"))?.get(),
            diameter_mm,
            edge_angle_deg: self.edge_angle_deg.unwrap_or(90.0),
            material: self.material_answer()?,
            immersion: self.immersion(diameter_mm)?,
            feed_per_tooth_mm: self
                .feed_per_tooth_mm
                .ok_or_else(|| wrong("--feed-per-tooth-mm"))?,
            rpm,
            power_w: self.power_w,
            torque_nm: self.torque_nm,
            name: self.name.unwrap_or_else(|| default_name.into()),
        })
    }

    fn missing(&self) -> Vec<Question> {
        let all = [
            (self.teeth.is_none(), "--teeth", "Number of teeth of the tool"),
            (
                self.diameter_mm.is_none(),
                "--diameter-mm",
                "Diameter of the tool in mm",
            ),
            (
                self.material.is_none() && self.ktc_mpa.is_none(),
                "--material",
                "Material (quietcut setup --materials lists them), or the tangential cutting coefficient in MPa",
            ),
            (
                self.down_milling_mm.is_none() && self.up_milling_mm.is_none() && !self.slot,
                "--down-milling-mm (or --up-milling-mm, --slot)",
                "Cut: `slot`, `up AE` or `down AE` with the radial depth AE in mm",
            ),
            (
                self.feed_per_tooth_mm.is_none(),
                "--feed-per-tooth-mm",
                "Feed per tooth in mm",
            ),
            (
                self.rpm.is_none(),
                "--rpm",
                "Lowest and highest spindle speed in rev/min, FIRST:LAST",
            ),
        ];
        all.into_iter()
            .filter(|(missing, ..)| *missing)
            .map(|(_, option, question)| Question { option, question })
            .collect()
    }

    /// Asks the user one question on the terminal until the answer is valid; an error if the input ends.
    fn ask(&mut self, question: &Question) -> Result<(), Error> {
        loop {
            eprint!("{}: ", question.question);
            io::stderr().flush().map_err(Error::other)?;
            let mut line = String::new();
            if io::stdin().lock().read_line(&mut line).map_err(Error::other)? == 0 {
                return Err(Error::input(format!(
                    "the input ended before {} was answered",
                    question.option
                )));
            }
            match self.take(question.option, line.trim()) {
                Ok(()) => return Ok(()),
                Err(reason) => eprintln!("  {reason}"),
            }
        }
    }

    /// Stores the user's answer to the question that belongs to `option`; the error says why the answer is not valid.
    fn take(&mut self, option: &str, answer: &str) -> Result<(), String> {
        match option {
            "--teeth" => self.teeth = Some(count(answer)?),
            "--diameter-mm" => self.diameter_mm = Some(positive(answer)?),
            "--material" => match positive(answer) {
                Ok(ktc_mpa) => self.ktc_mpa = Some(ktc_mpa),
                Err(_) => {
                    material_of(answer)?;
                    self.material = Some(answer.into());
                }
            },
            "--feed-per-tooth-mm" => self.feed_per_tooth_mm = Some(positive(answer)?),
            "--rpm" => {
                speeds(answer).map_err(|error| error.to_string())?;
                self.rpm = Some(answer.into());
            }
            _ => match answer.split_whitespace().collect::<Vec<_>>()[..] {
                ["slot"] => self.slot = true,
                ["up", depth] => self.up_milling_mm = Some(positive(depth)?),
                ["down", depth] => self.down_milling_mm = Some(positive(depth)?),
                _ => return Err(format!("`{answer}` is not `slot`, `up AE` or `down AE`")),
            },
        }
        Ok(())
    }

    fn material_answer(&self) -> Result<MaterialAnswer, Error> {
        if let Some(name) = &self.material {
            return material_of(name).map_err(Error::input);
        }
        let ktc_mpa = self
            .ktc_mpa
            .ok_or_else(|| Error::input("--material or --ktc-mpa is missing"))?;
        // Without a measurement the radial cutting coefficient is three tenths of the tangential one, as textbooks
        // assume for a sharp edge.
        let krc_mpa = self.krc_mpa.unwrap_or(0.3 * ktc_mpa);
        Ok(MaterialAnswer::Given {
            cutting_mpa: [ktc_mpa, krc_mpa, self.kac_mpa.unwrap_or(0.0)],
            ktc_std_mpa: self.ktc_mpa_std,
            radial_is_assumed: self.krc_mpa.is_none(),
        })
    }

    fn immersion(&self, diameter_mm: f64) -> Result<Immersion, Error> {
        let (radial_depth_mm, option) = match (self.down_milling_mm, self.up_milling_mm) {
            (Some(depth_mm), _) => (depth_mm, "--down-milling-mm"),
            (None, Some(depth_mm)) => (depth_mm, "--up-milling-mm"),
            (None, None) => return Ok(Immersion::SLOT),
        };
        if radial_depth_mm > diameter_mm {
            return Err(Error::input(format!(
                "{option} {radial_depth_mm}: the radial depth cannot be larger than the diameter, {diameter_mm} mm"
            )));
        }
        Ok(if option == "--down-milling-mm" {
            Immersion::down(radial_depth_mm, diameter_mm)
        } else {
            Immersion::up(radial_depth_mm, diameter_mm)
        })
    }
}

fn material_of(name: &str) -> Result<MaterialAnswer, String> {
    if let Some(range) = MaterialRange::of(name) {
        return Ok(MaterialAnswer::Range(range));
    }
    let names: Vec<&str> = RANGES.iter().map(|range| range.name).collect();
    Err(format!(
        "`{name}` is no class of materials with coefficients; there are: {}. Give yours with --ktc-mpa, and --ktc-mpa-std if it is uncertain",
        names.join(", ")
    ))
}

/// Parses the lowest and the highest spindle speed, `first:last` in rev/min.
fn speeds(text: &str) -> Result<(f64, f64), Error> {
    let wrong = || {
        Error::input(format!(
            "--rpm {text}: two speeds first:last in rev/min are needed, the lower first, such as 600:12000"
        ))
    };
    match non_negative_ends(text) {
        Ok([low, high]) if low > 0.0 => Ok((low, high)),
        _ => Err(wrong()),
    }
}
