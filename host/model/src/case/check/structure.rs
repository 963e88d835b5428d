//! Reads the structure from the case file, with the standard deviations of its parameters: here matrices and modes, in
//! `joints` those of a robot.

use nalgebra::DMatrix;
use num_complex::Complex64;
use toml::Spanned;

use super::Check;
use crate::case::file::{ModeFile, Number, Rows, StructureFile};
use crate::case::{CaseError, Parameter};
use crate::structure::{Direction, Form, Matrices, Mode, Structure};

/// Mode shape as a case gives it: real and imaginary part of each entry.
type ShapeFile = Spanned<Vec<[f64; 2]>>;

impl Check<'_> {
    pub(super) fn structure(
        &mut self,
        file: &Spanned<StructureFile>,
        joints_deg: &[f64],
    ) -> Result<Structure, CaseError> {
        let directions = self.directions(&file.get_ref().directions)?;
        self.no_joints_but_with_their_kind(file)?;
        let form = match file.get_ref().kind.get_ref().as_str() {
            "matrices" => Form::Matrices(self.matrices(file, directions.len())?),
            "modes" => Form::Modes(self.modes(file, directions.len())?),
            "joints" => Form::Joints(Box::new(self.robot(file, &directions, joints_deg)?)),
            other => {
                let kind = &file.get_ref().kind;
                return Err(self.wrong(
                    kind,
                    "structure.kind",
                    format!("\"{other}\""),
                    "\"matrices\", \"modes\" or \"joints\"",
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
        self.no_matrices(table, "[[structure.mode]] tables only (kind = \"modes\")")?;
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

    /// Refuses matrices of mass, damping, stiffness and cubic terms, and their standard deviations, in a structure of
    /// another kind.
    pub(super) fn no_matrices(&self, table: &StructureFile, expected: &str) -> Result<(), CaseError> {
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
                return Err(self.wrong(rows, &format!("structure.{key}"), "a matrix", expected));
            }
        }
        Ok(())
    }

    fn mode(&mut self, file: &ModeFile, index: usize, size: usize) -> Result<Mode, CaseError> {
        let key = |name: &str| format!("structure.mode[{}].{name}", index + 1);
        let mode = self.poles_and_shapes(
            (&file.frequency_hz, &file.damping_ratio),
            (&file.left, &file.right),
            size,
            key,
        )?;
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
        Ok(mode)
    }

    /// A mode without its deviations; `key` gives the full name of a key for messages.
    pub(super) fn poles_and_shapes(
        &self,
        (frequency_hz, damping_ratio): (&Number, &Number),
        (left, right): (&ShapeFile, &ShapeFile),
        size: usize,
        key: impl Fn(&str) -> String,
    ) -> Result<Mode, CaseError> {
        let frequency_hz = self.positive(frequency_hz, &key("frequency_hz"))?;
        let percent = *damping_ratio.get_ref();
        let expected = if (1.0..100.0).contains(&percent) {
            format!(
                "a damping ratio from 0 to below 1, such as {} for {percent} %,",
                0.01 * percent
            )
        } else {
            "a damping ratio from 0 to below 1".into()
        };
        Ok(Mode {
            frequency_hz,
            damping_ratio: self.number(
                damping_ratio,
                &key("damping_ratio"),
                |x| (0.0..1.0).contains(&x),
                &expected,
            )?,
            left: self.shape(left, &key("left"), size)?,
            right: self.shape(right, &key("right"), size)?,
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
}

fn expected_shape(size: usize) -> String {
    format!("{size} rows of {size} numbers, one for each direction")
}
