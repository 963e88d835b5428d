//! From the shape of a case file to a case: every value is judged here.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::DMatrix;
use num_complex::Complex64;
use toml::Spanned;

use super::file::{CaseFile, CutFile, LimitsFile, MaterialFile, ModeFile, Number, PostureFile, Rows};
use super::file::{StructureFile, ToolFile};
use super::{Case, CaseError, Deviation, MachineLimits, Parameter, Posture, extension};
use crate::milling::{Cut, Material, Runout, Tool};
use crate::structure::{Direction, Form, Matrices, Mode, Structure};

/// The most teeth a tool may have: beyond that the number is a slip of the pen.
const TEETH_MAX: i64 = 64;

pub(super) fn case(path: &Path, text: &str) -> Result<Case, CaseError> {
    let file: CaseFile = toml::from_str(text).map_err(|error| syntax(path, text, &error))?;
    let mut check = Check {
        path,
        text,
        deviations: Vec::new(),
    };
    let structure = file
        .structure
        .map(|structure| check.structure(structure))
        .transpose()?;
    let tool = file.tool.map(|tool| check.tool(&tool)).transpose()?;
    let material = file
        .material
        .map(|material| check.material(&material))
        .transpose()?;
    let cut = file.cut.map(|cut| check.cut(&cut)).transpose()?;
    let limits = file.limits.map(|limits| check.limits(&limits)).transpose()?;
    let posture = file
        .posture
        .map_or(Ok(Posture::default()), |posture| check.posture(posture))?;
    let extensions = check.extensions(file.extension)?;
    let name = file.name.unwrap_or_else(|| {
        path.file_stem()
            .map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
    });
    Ok(Case {
        path: path.into(),
        name,
        structure,
        tool,
        material,
        cut,
        limits,
        posture,
        deviations: check.deviations,
        extensions,
    })
}

fn syntax(path: &Path, text: &str, error: &toml::de::Error) -> CaseError {
    let line = line_of(text, error.span().map_or(0, |span| span.start));
    CaseError::Syntax {
        path: path.into(),
        line,
        source_line: text.lines().nth(line - 1).unwrap_or("").trim().into(),
        message: error.message().trim().replace('\n', ", "),
    }
}

/// The line, from 1, in which a byte of the text stands.
fn line_of(text: &str, offset: usize) -> usize {
    1 + text.bytes().take(offset).filter(|&byte| byte == b'\n').count()
}

struct Check<'a> {
    path: &'a Path,
    text: &'a str,
    deviations: Vec<Deviation>,
}

impl Check<'_> {
    fn wrong<T>(
        &self,
        at: &Spanned<T>,
        key: &str,
        found: impl ToString,
        expected: impl Into<String>,
    ) -> CaseError {
        CaseError::Value {
            path: self.path.into(),
            line: line_of(self.text, at.span().start),
            key: key.into(),
            found: found.to_string(),
            expected: expected.into(),
        }
    }

    fn number(
        &self,
        value: &Number,
        key: &str,
        allowed: impl Fn(f64) -> bool,
        expected: &str,
    ) -> Result<f64, CaseError> {
        let number = *value.get_ref();
        if number.is_finite() && allowed(number) {
            Ok(number)
        } else {
            Err(self.wrong(value, key, number, expected))
        }
    }

    fn positive(&self, value: &Number, key: &str) -> Result<f64, CaseError> {
        self.number(value, key, |x| x > 0.0, "a number greater than 0")
    }

    fn finite(&self, value: &Number, key: &str) -> Result<f64, CaseError> {
        self.number(value, key, |_| true, "a finite number")
    }

    fn finite_or(&self, value: &Option<Number>, key: &str, default: f64) -> Result<f64, CaseError> {
        value
            .as_ref()
            .map_or(Ok(default), |value| self.finite(value, key))
    }

    fn deviation(
        &mut self,
        value: &Option<Number>,
        key: &str,
        parameter: Parameter,
    ) -> Result<(), CaseError> {
        let Some(value) = value else { return Ok(()) };
        let key = format!("{key}_std");
        let std = self.number(value, &key, |x| x >= 0.0, "a standard deviation of 0 or more")?;
        self.push_deviation(parameter, std);
        Ok(())
    }

    fn push_deviation(&mut self, parameter: Parameter, std: f64) {
        if std > 0.0 {
            self.deviations.push(Deviation { parameter, std });
        }
    }

    fn structure(&mut self, file: Spanned<StructureFile>) -> Result<Structure, CaseError> {
        let directions = self.directions(&file.get_ref().directions)?;
        let form = match file.get_ref().kind.get_ref().as_str() {
            "matrices" => Form::Matrices(self.matrices(&file, directions.len())?),
            "modes" => Form::Modes(self.modes(&file, directions.len())?),
            other => {
                let kind = &file.get_ref().kind;
                return Err(self.wrong(
                    kind,
                    "structure.kind",
                    format!("\"{other}\""),
                    "\"matrices\" or \"modes\"",
                ));
            }
        };
        Ok(Structure { directions, form })
    }

    fn directions(&self, names: &Spanned<Vec<String>>) -> Result<Vec<Direction>, CaseError> {
        let key = "structure.directions";
        let mut directions = Vec::new();
        for name in names.get_ref() {
            let direction: Direction = name.parse().map_err(|_| {
                self.wrong(
                    names,
                    key,
                    format!("\"{name}\""),
                    "a list of x, y, z, rx, ry and rz",
                )
            })?;
            if directions.contains(&direction) {
                return Err(self.wrong(
                    names,
                    key,
                    format!("\"{name}\" twice"),
                    "each direction at most once",
                ));
            }
            directions.push(direction);
        }
        if !directions.iter().any(|direction| direction.axis().is_some()) {
            let found = format!("{:?}", names.get_ref());
            return Err(self.wrong(names, key, found, "at least one of x, y and z, where forces act"));
        }
        Ok(directions)
    }

    fn matrices(&mut self, file: &Spanned<StructureFile>, size: usize) -> Result<Matrices, CaseError> {
        let table = file.get_ref();
        if let Some(mode) = table.mode.as_ref().and_then(|modes| modes.first()) {
            return Err(self.wrong(
                mode,
                "structure.mode",
                "a mode",
                "mass, damping and stiffness (kind = \"matrices\")",
            ));
        }
        let mass = self.needed_matrix(file, &table.mass, "structure.mass", size)?;
        let damping = self.needed_matrix(file, &table.damping, "structure.damping", size)?;
        let stiffness = self.needed_matrix(file, &table.stiffness, "structure.stiffness", size)?;
        let cubic_damping = self.matrix(&table.cubic_damping, "structure.cubic_damping", size)?;
        let cubic_stiffness = self.matrix(&table.cubic_stiffness, "structure.cubic_stiffness", size)?;
        self.matrix_deviation(&table.mass_std, "structure.mass", size, Parameter::Mass)?;
        self.matrix_deviation(&table.damping_std, "structure.damping", size, Parameter::Damping)?;
        self.matrix_deviation(
            &table.stiffness_std,
            "structure.stiffness",
            size,
            Parameter::Stiffness,
        )?;
        self.matrix_deviation(
            &table.cubic_damping_std,
            "structure.cubic_damping",
            size,
            Parameter::CubicDamping,
        )?;
        self.matrix_deviation(
            &table.cubic_stiffness_std,
            "structure.cubic_stiffness",
            size,
            Parameter::CubicStiffness,
        )?;
        Ok(Matrices {
            mass,
            damping,
            stiffness,
            cubic_damping,
            cubic_stiffness,
        })
    }

    fn needed_matrix(
        &self,
        structure: &Spanned<StructureFile>,
        rows: &Option<Rows>,
        key: &str,
        size: usize,
    ) -> Result<DMatrix<f64>, CaseError> {
        self.matrix(rows, key, size)?
            .ok_or_else(|| self.wrong(structure, key, "nothing", expected_shape(size)))
    }

    fn matrix(&self, rows: &Option<Rows>, key: &str, size: usize) -> Result<Option<DMatrix<f64>>, CaseError> {
        let Some(rows) = rows else { return Ok(None) };
        let lines = rows.get_ref();
        if lines.len() != size {
            return Err(self.wrong(rows, key, format!("{} rows", lines.len()), expected_shape(size)));
        }
        for (i, line) in lines.iter().enumerate() {
            if line.len() != size {
                let found = format!("{} entries in row {}", line.len(), i + 1);
                return Err(self.wrong(rows, key, found, expected_shape(size)));
            }
            if let Some(j) = line.iter().position(|entry| !entry.is_finite()) {
                let found = format!("{} in row {}, column {}", line[j], i + 1, j + 1);
                return Err(self.wrong(rows, key, found, "a finite number"));
            }
        }
        Ok(Some(DMatrix::from_row_iterator(
            size,
            size,
            lines.iter().flatten().copied(),
        )))
    }

    fn matrix_deviation(
        &mut self,
        rows: &Option<Rows>,
        key: &str,
        size: usize,
        parameter: fn(usize, usize) -> Parameter,
    ) -> Result<(), CaseError> {
        let key = format!("{key}_std");
        let (Some(matrix), Some(rows)) = (self.matrix(rows, &key, size)?, rows) else {
            return Ok(());
        };
        for i in 0..size {
            for j in 0..size {
                let std = matrix[(i, j)];
                if std < 0.0 {
                    let found = format!("{std} in row {}, column {}", i + 1, j + 1);
                    return Err(self.wrong(rows, &key, found, "standard deviations of 0 or more"));
                }
                self.push_deviation(parameter(i, j), std);
            }
        }
        Ok(())
    }

    fn modes(&mut self, file: &Spanned<StructureFile>, size: usize) -> Result<Vec<Mode>, CaseError> {
        let table = file.get_ref();
        let strangers = [
            ("mass", &table.mass),
            ("mass_std", &table.mass_std),
            ("damping", &table.damping),
            ("damping_std", &table.damping_std),
            ("stiffness", &table.stiffness),
            ("stiffness_std", &table.stiffness_std),
            ("cubic_damping", &table.cubic_damping),
            ("cubic_damping_std", &table.cubic_damping_std),
            ("cubic_stiffness", &table.cubic_stiffness),
            ("cubic_stiffness_std", &table.cubic_stiffness_std),
        ];
        for (key, rows) in strangers {
            if let Some(rows) = rows {
                let expected = "[[structure.mode]] tables only (kind = \"modes\")";
                return Err(self.wrong(rows, &format!("structure.{key}"), "a matrix", expected));
            }
        }
        match &table.mode {
            Some(modes) if !modes.is_empty() => modes
                .iter()
                .enumerate()
                .map(|(index, mode)| self.mode(mode.get_ref(), index, size))
                .collect(),
            _ => Err(self.wrong(
                file,
                "structure.mode",
                "nothing",
                "at least one [[structure.mode]]",
            )),
        }
    }

    fn mode(&mut self, file: &ModeFile, index: usize, size: usize) -> Result<Mode, CaseError> {
        let key = |name: &str| format!("structure.mode[{}].{name}", index + 1);
        let frequency_hz = self.positive(&file.frequency_hz, &key("frequency_hz"))?;
        let damping_ratio = self.number(
            &file.damping_ratio,
            &key("damping_ratio"),
            |x| (0.0..1.0).contains(&x),
            "a damping ratio from 0 to below 1",
        )?;
        let left = self.shape(&file.left, &key("left"), size)?;
        let right = self.shape(&file.right, &key("right"), size)?;
        self.deviation(
            &file.frequency_hz_std,
            &key("frequency_hz"),
            Parameter::Frequency(index),
        )?;
        self.deviation(
            &file.damping_ratio_std,
            &key("damping_ratio"),
            Parameter::DampingRatio(index),
        )?;
        self.shape_deviation(&file.left_std, &key("left_std"), size, |entry, imaginary| {
            Parameter::Left(index, entry, imaginary)
        })?;
        self.shape_deviation(&file.right_std, &key("right_std"), size, |entry, imaginary| {
            Parameter::Right(index, entry, imaginary)
        })?;
        Ok(Mode {
            frequency_hz,
            damping_ratio,
            left,
            right,
        })
    }

    fn shape(
        &self,
        shape: &Spanned<Vec<[f64; 2]>>,
        key: &str,
        size: usize,
    ) -> Result<Vec<Complex64>, CaseError> {
        let entries = shape.get_ref();
        if entries.len() != size {
            let found = format!("{} entries", entries.len());
            let expected = format!("[real, imaginary] for each of the {size} directions");
            return Err(self.wrong(shape, key, found, expected));
        }
        match entries.iter().flatten().find(|part| !part.is_finite()) {
            Some(part) => Err(self.wrong(shape, key, part, "a finite number")),
            None => Ok(entries.iter().map(|&[re, im]| Complex64::new(re, im)).collect()),
        }
    }

    fn shape_deviation(
        &mut self,
        shape: &Option<Spanned<Vec<[f64; 2]>>>,
        key: &str,
        size: usize,
        parameter: impl Fn(usize, bool) -> Parameter,
    ) -> Result<(), CaseError> {
        let Some(shape) = shape else { return Ok(()) };
        for (entry, std) in self.shape(shape, key, size)?.into_iter().enumerate() {
            for (imaginary, std) in [(false, std.re), (true, std.im)] {
                if std < 0.0 {
                    return Err(self.wrong(shape, key, std, "standard deviations of 0 or more"));
                }
                self.push_deviation(parameter(entry, imaginary), std);
            }
        }
        Ok(())
    }

    fn tool(&mut self, file: &ToolFile) -> Result<Tool, CaseError> {
        let teeth = *file.teeth.get_ref();
        if !(1..=TEETH_MAX).contains(&teeth) {
            let expected = format!("a whole number of teeth from 1 to {TEETH_MAX}");
            return Err(self.wrong(&file.teeth, "tool.teeth", teeth, expected));
        }
        // In 1 ..= TEETH_MAX: the conversion is exact.
        let teeth = teeth as usize;
        let edge_angle_deg = self.number(
            &file.edge_angle_deg,
            "tool.edge_angle_deg",
            |x| x > 0.0 && x <= 90.0,
            "an angle above 0 and up to 90",
        )?;
        let diameter_mm = match &file.diameter_mm {
            Some(diameter) => Some(self.positive(diameter, "tool.diameter_mm")?),
            None => None,
        };
        self.deviation(
            &file.edge_angle_deg_std,
            "tool.edge_angle_deg",
            Parameter::EdgeAngle,
        )?;
        Ok(Tool {
            teeth,
            edge_angle_deg,
            diameter_mm,
            pitch_deg: self.pitch(&file.pitch_deg, teeth)?,
            runout: self.runout(file)?,
        })
    }

    fn pitch(&self, pitch: &Option<Spanned<Vec<f64>>>, teeth: usize) -> Result<Vec<f64>, CaseError> {
        let Some(pitch) = pitch else {
            return Ok(vec![360.0 / teeth as f64; teeth]);
        };
        let angles = pitch.get_ref();
        let key = "tool.pitch_deg";
        if angles.len() != teeth {
            let found = format!("{} angles", angles.len());
            return Err(self.wrong(pitch, key, found, format!("one angle for each of {teeth} teeth")));
        }
        if let Some(angle) = angles.iter().find(|angle| !(angle.is_finite() && **angle > 0.0)) {
            return Err(self.wrong(pitch, key, angle, "angles greater than 0"));
        }
        let sum: f64 = angles.iter().sum();
        // Printed angles carry about three digits after the point.
        if (sum - 360.0).abs() > 0.01 {
            return Err(self.wrong(pitch, key, format!("the sum {sum}"), "angles that sum to 360"));
        }
        Ok(angles.iter().map(|angle| angle * 360.0 / sum).collect())
    }

    fn runout(&mut self, file: &ToolFile) -> Result<Option<Runout>, CaseError> {
        let angle_deg = self.finite_or(&file.runout_angle_deg, "tool.runout_angle_deg", 0.0)?;
        self.deviation(&file.runout_um_std, "tool.runout_um", Parameter::RunoutOffset)?;
        self.deviation(
            &file.runout_angle_deg_std,
            "tool.runout_angle_deg",
            Parameter::RunoutAngle,
        )?;
        match (&file.runout_um, &file.runout_angle_deg) {
            (Some(offset), _) => {
                let offset_um = self.number(offset, "tool.runout_um", |x| x >= 0.0, "0 or more")?;
                Ok(Some(Runout { offset_um, angle_deg }))
            }
            (None, Some(angle)) => Err(self.wrong(
                angle,
                "tool.runout_angle_deg",
                "an angle alone",
                "runout_um beside it",
            )),
            (None, None) => Ok(None),
        }
    }

    fn material(&mut self, file: &MaterialFile) -> Result<Material, CaseError> {
        let material = Material {
            ktc_mpa: self.positive(&file.ktc_mpa, "material.ktc_mpa")?,
            krc_mpa: self.finite(&file.krc_mpa, "material.krc_mpa")?,
            kac_mpa: self.finite(&file.kac_mpa, "material.kac_mpa")?,
            kte_n_per_mm: self.finite_or(&file.kte_n_per_mm, "material.kte_n_per_mm", 0.0)?,
            kre_n_per_mm: self.finite_or(&file.kre_n_per_mm, "material.kre_n_per_mm", 0.0)?,
            kae_n_per_mm: self.finite_or(&file.kae_n_per_mm, "material.kae_n_per_mm", 0.0)?,
        };
        self.deviation(&file.ktc_mpa_std, "material.ktc_mpa", Parameter::Ktc)?;
        self.deviation(&file.krc_mpa_std, "material.krc_mpa", Parameter::Krc)?;
        self.deviation(&file.kac_mpa_std, "material.kac_mpa", Parameter::Kac)?;
        self.deviation(&file.kte_n_per_mm_std, "material.kte_n_per_mm", Parameter::Kte)?;
        self.deviation(&file.kre_n_per_mm_std, "material.kre_n_per_mm", Parameter::Kre)?;
        self.deviation(&file.kae_n_per_mm_std, "material.kae_n_per_mm", Parameter::Kae)?;
        Ok(material)
    }

    fn cut(&mut self, file: &CutFile) -> Result<Cut, CaseError> {
        let start_deg = self.number(
            &file.start_deg,
            "cut.start_deg",
            |x| (0.0..180.0).contains(&x),
            "an angle from 0 to below 180",
        )?;
        let exit_deg = self.number(
            &file.exit_deg,
            "cut.exit_deg",
            |x| x > start_deg && x <= 180.0,
            &format!("an angle above cut.start_deg ({start_deg}) and up to 180"),
        )?;
        let feed_per_tooth_mm = self.number(
            &file.feed_per_tooth_mm,
            "cut.feed_per_tooth_mm",
            |x| x >= 0.0,
            "a feed of 0 or more",
        )?;
        let feed_direction_deg = self.finite_or(&file.feed_direction_deg, "cut.feed_direction_deg", 0.0)?;
        self.deviation(&file.start_deg_std, "cut.start_deg", Parameter::Start)?;
        self.deviation(&file.exit_deg_std, "cut.exit_deg", Parameter::Exit)?;
        self.deviation(
            &file.feed_per_tooth_mm_std,
            "cut.feed_per_tooth_mm",
            Parameter::FeedPerTooth,
        )?;
        self.deviation(
            &file.feed_direction_deg_std,
            "cut.feed_direction_deg",
            Parameter::FeedDirection,
        )?;
        Ok(Cut {
            start_deg,
            exit_deg,
            feed_per_tooth_mm,
            feed_direction_deg,
        })
    }

    fn limits(&self, file: &LimitsFile) -> Result<MachineLimits, CaseError> {
        let rpm_min = self.number(&file.rpm_min, "limits.rpm_min", |x| x >= 0.0, "0 or more")?;
        let rpm_max = self.number(
            &file.rpm_max,
            "limits.rpm_max",
            |x| x > rpm_min,
            &format!("a speed above limits.rpm_min ({rpm_min})"),
        )?;
        let power_w = match &file.power_w {
            Some(power) => Some(self.positive(power, "limits.power_w")?),
            None => None,
        };
        Ok(MachineLimits {
            rpm_min,
            rpm_max,
            power_w,
        })
    }

    fn posture(&self, file: PostureFile) -> Result<Posture, CaseError> {
        let index = match &file.index {
            None => 0,
            Some(index) => u8::try_from(*index.get_ref())
                .map_err(|_| self.wrong(index, "posture.index", index.get_ref(), "0 to 255"))?,
        };
        if let Some(joints) = &file.joints_deg
            && let Some(angle) = joints.get_ref().iter().find(|angle| !angle.is_finite())
        {
            return Err(self.wrong(joints, "posture.joints_deg", angle, "finite angles"));
        }
        Ok(Posture {
            index,
            joints_deg: file.joints_deg.map_or_else(Vec::new, Spanned::into_inner),
        })
    }

    fn extensions(
        &self,
        file: BTreeMap<Spanned<String>, toml::Table>,
    ) -> Result<BTreeMap<String, toml::Table>, CaseError> {
        let mut extensions = BTreeMap::new();
        for (name, table) in file {
            if !extension::NAMES.contains(&name.get_ref().as_str()) {
                let expected = format!("one of {}", extension::NAMES.join(", "));
                return Err(self.wrong(&name, "extension", format!("\"{}\"", name.get_ref()), expected));
            }
            if name.get_ref() == extension::AXIAL_DEPTH_MODULATION {
                self.axial_depth_modulation(&name, &table)?;
            }
            extensions.insert(name.into_inner(), table);
        }
        Ok(extensions)
    }

    fn axial_depth_modulation(&self, at: &Spanned<String>, table: &toml::Table) -> Result<(), CaseError> {
        let key = "extension.axial-depth-modulation";
        if let Some(stranger) = table.keys().find(|key| *key != "on") {
            return Err(self.wrong(at, key, format!("the key {stranger}"), "the key on, alone"));
        }
        match table.get("on") {
            Some(toml::Value::Boolean(_)) => Ok(()),
            other => {
                let found = other.map_or_else(|| "nothing".into(), |value| format!("on = {value}"));
                Err(self.wrong(at, key, found, "on = true or on = false"))
            }
        }
    }
}

fn expected_shape(size: usize) -> String {
    format!("{size} rows of {size} numbers, one for each direction")
}
