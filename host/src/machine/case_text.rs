//! A commented case file from the answers of a user.

use std::fmt::Write;

use super::material_table::MaterialRange;

/// Immersion of the cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Immersion {
    /// Angle at which a tooth enters the cut, degrees, clockwise from the normal to the feed.
    pub start_deg: f64,
    /// Angle at which a tooth leaves the cut, degrees, clockwise from the normal to the feed.
    pub exit_deg: f64,
}

impl Immersion {
    /// Immersion of a slot, where the radial depth equals the diameter: from 0 to 180°.
    pub const SLOT: Self = Self {
        start_deg: 0.0,
        exit_deg: 180.0,
    };

    /// Immersion of up-milling with a radial depth a_e and a diameter D: from 0 to arccos(1 − 2a_e/D).
    pub fn up(radial_depth_mm: f64, diameter_mm: f64) -> Self {
        Self {
            start_deg: 0.0,
            exit_deg: engaged_deg(radial_depth_mm, diameter_mm),
        }
    }

    /// Immersion of down-milling with a radial depth a_e and a diameter D: from 180° − arccos(1 − 2a_e/D) to 180°.
    pub fn down(radial_depth_mm: f64, diameter_mm: f64) -> Self {
        Self {
            start_deg: 180.0 - engaged_deg(radial_depth_mm, diameter_mm),
            exit_deg: 180.0,
        }
    }
}

/// Angle over which a tooth is engaged, arccos(1 − 2a_e/D), degrees, with radial depth a_e and diameter D.
fn engaged_deg(radial_depth_mm: f64, diameter_mm: f64) -> f64 {
    (1.0 - 2.0 * radial_depth_mm / diameter_mm)
        .clamp(-1.0, 1.0)
        .acos()
        .to_degrees()
}

/// Cutting coefficients of the workpiece material: a range from the literature, or values of the user.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MaterialAnswer {
    /// Class of materials, whose coefficients are only known to lie in a range.
    Range(&'static MaterialRange),
    /// Specific cutting coefficients that the user gives; the radial one may be assumed.
    Given {
        /// Tangential, radial and axial specific cutting coefficient, MPa.
        cutting_mpa: [f64; 3],
        /// Standard deviation of the tangential specific cutting coefficient, MPa; `None` if unknown.
        ktc_std_mpa: Option<f64>,
        /// True if the radial cutting coefficient is an assumed share of the tangential one and not given by the user.
        radial_is_assumed: bool,
    },
}

/// Answers of the user to `quietcut setup` about machine, tool, material and cut.
#[derive(Clone, Debug, PartialEq)]
pub struct Answers {
    /// Name of the machine and job.
    pub name: String,
    /// Notes for the comments at the head of the case file: machine, holder or sensor, each with the text of the user.
    pub notes: Vec<(&'static str, String)>,
    /// Number of teeth.
    pub teeth: u8,
    /// Diameter of the tool, mm.
    pub diameter_mm: f64,
    /// Edge angle, degrees.
    pub edge_angle_deg: f64,
    /// The material.
    pub material: MaterialAnswer,
    /// Immersion.
    pub immersion: Immersion,
    /// Feed per tooth, mm.
    pub feed_per_tooth_mm: f64,
    /// Lowest and highest speed of the spindle, rev/min.
    pub rpm: (f64, f64),
    /// Power of the spindle, W; `None` if not given.
    pub power_w: Option<f64>,
    /// Torque of the spindle, N·m; `None` if not given.
    pub torque_nm: Option<f64>,
}

/// Text of a case file from the answers of the user, with comments. The case has no structure: `identify` adds the
/// structure from tap tests.
pub fn case_text(answers: &Answers) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = write_case(&mut text, answers);
    text
}

fn write_case(text: &mut String, answers: &Answers) -> std::fmt::Result {
    writeln!(
        text,
        "# One machine and one job. The structure is missing: quietcut identify writes it from taps."
    )?;
    for (what, said) in &answers.notes {
        writeln!(text, "# {what}: {}", said.replace(['\n', '\r'], " "))?;
    }
    writeln!(text, "name = {}\n", toml::Value::String(answers.name.clone()))?;
    for section in Section::ALL {
        write_section(text, answers, section)?;
    }
    Ok(())
}

/// Section of a case file that the answers of a user give.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Section {
    /// `[tool]`.
    Tool,
    /// `[material]`.
    Material,
    /// `[cut]`.
    Cut,
    /// `[limits]`.
    Limits,
}

impl Section {
    /// All sections, in the order in which [`case_text`] writes them.
    pub const ALL: [Self; 4] = [Self::Tool, Self::Material, Self::Cut, Self::Limits];

    /// Name of the section in a case file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tool => "tool",
            Self::Material => "material",
            Self::Cut => "cut",
            Self::Limits => "limits",
        }
    }
}

/// Text of the given sections of a case file, in their order, from the answers of the user; it is appended to a case
/// that lacks them.
pub fn section_text(answers: &Answers, sections: &[Section]) -> String {
    let mut text = String::new();
    for section in sections {
        // Writing to a String cannot fail.
        let _ = write_section(&mut text, answers, *section);
    }
    text
}

fn write_section(text: &mut String, answers: &Answers, section: Section) -> std::fmt::Result {
    match section {
        Section::Tool => {
            writeln!(text, "[tool]\nteeth = {}", answers.teeth)?;
            writeln!(
                text,
                "# 90 is a square end mill.\nedge_angle_deg = {}",
                float(answers.edge_angle_deg)
            )?;
            writeln!(text, "diameter_mm = {}\n", float(answers.diameter_mm))
        }
        Section::Material => write_material(text, answers),
        Section::Cut => {
            writeln!(
                text,
                "[cut]\n# Immersion angles count from the normal to the feed, in the sense in which the tool rotates."
            )?;
            writeln!(text, "start_deg = {}", float(answers.immersion.start_deg))?;
            writeln!(text, "exit_deg = {}", float(answers.immersion.exit_deg))?;
            writeln!(text, "feed_per_tooth_mm = {}\n", float(answers.feed_per_tooth_mm))
        }
        Section::Limits => {
            writeln!(text, "[limits]\n# Speeds outside are never proposed.")?;
            writeln!(
                text,
                "rpm_min = {}\nrpm_max = {}",
                float(answers.rpm.0),
                float(answers.rpm.1)
            )?;
            if let Some(power_w) = answers.power_w {
                writeln!(text, "power_w = {}", float(power_w))?;
            }
            if let Some(torque_nm) = answers.torque_nm {
                writeln!(text, "torque_nm = {}", float(torque_nm))?;
            }
            Ok(())
        }
    }
}

fn write_material(text: &mut String, answers: &Answers) -> std::fmt::Result {
    writeln!(text, "[material]")?;
    let ([ktc, krc, kac], std) = match answers.material {
        MaterialAnswer::Range(range) => {
            let (ktc, ktc_std) = MaterialRange::mean_and_std(range.ktc_mpa);
            let (ratio, ratio_std) = MaterialRange::mean_and_std(range.radial_ratio);
            writeln!(text, "# {}: {}.", range.what, range.source)?;
            writeln!(
                text,
                "# ktc lies between {} and {} MPa there. Where each value in a range is as likely as another, the mean is",
                range.ktc_mpa[0], range.ktc_mpa[1]
            )?;
            writeln!(
                text,
                "# (a + b)/2 and the standard deviation (b - a)/sqrt(12). Limits get a band from it. Measure your own:"
            )?;
            writeln!(text, "# quietcut identify --method force-coefficients.")?;
            // Standard deviation of the product krc = ktc · (krc/ktc) of two independent factors, to first order.
            let krc_std = ((ratio * ktc_std).powi(2) + (ktc * ratio_std).powi(2)).sqrt();
            ([ktc, ratio * ktc, 0.0], Some([ktc_std, krc_std]))
        }
        MaterialAnswer::Given {
            cutting_mpa,
            ktc_std_mpa,
            radial_is_assumed,
        } => {
            if radial_is_assumed {
                writeln!(
                    text,
                    "# krc is assumed to be 0.3 ktc. Measure it: quietcut identify --method force-coefficients."
                )?;
            }
            (cutting_mpa, ktc_std_mpa.map(|std| [std, 0.0]))
        }
    };
    for (key, value) in [("ktc_mpa", ktc), ("krc_mpa", krc), ("kac_mpa", kac)] {
        writeln!(text, "{key} = {}", float(value))?;
    }
    for (key, value) in ["ktc_mpa_std", "krc_mpa_std"]
        .into_iter()
        .zip(std.into_iter().flatten())
    {
        if value > 0.0 {
            writeln!(text, "{key} = {}", float(value))?;
        }
    }
    writeln!(text)
}

/// A number as text of a TOML file, rounded to 13 significant digits to hide small rounding errors.
fn float(value: f64) -> String {
    let rounded: f64 = format!("{value:.12e}").parse().unwrap_or(value);
    format!("{rounded:?}")
}
