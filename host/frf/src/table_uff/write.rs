//! Writer of FRF tables in UFF 58.

use std::path::Path;

use super::FOLDING;
use crate::{Frf, FrfError, FrfTable};
use quietcut_model::structure::Direction;
use quietcut_recording::Quantity;
use quietcut_recording::uff::{
    Axis, DegreeOfFreedom, Function, Header, OrdinateType, UffForm, Values, axis_of, write_set, write_units,
};

impl FrfTable {
    /// Writes the table to `path` as UFF 58, receptances in m/N, atomically: on an error the previous file stays
    /// unchanged. Text keeps thirteen digits of receptances and coherences, binary all. An evenly spaced table is
    /// written with seven digits of first frequency and spacing; otherwise text keeps seven digits of each frequency,
    /// binary all.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_uff(&self, path: &Path, form: UffForm) -> Result<(), FrfError> {
        let even = self.even();
        let uneven = even.is_none().then(|| self.frequency_hz());
        quietcut_recording::file::write_with(path, |out| {
            write_units(out)?;
            for entry in self.entries() {
                let header = header(entry, even);
                write_set(out, &header, uneven, Values::Complex(&entry.receptance), form)?;
                let beside = |words: [String; 5], function| Header {
                    words,
                    function,
                    ordinate: axis_of(Quantity::Level),
                    denominator: Axis::default(),
                    ordinate_type: OrdinateType {
                        is_double: true,
                        is_complex: false,
                    },
                    ..header.clone()
                };
                if let Some(coherence) = &entry.coherence {
                    let header = beside(header.words.clone(), Function::Coherence);
                    write_set(out, &header, uneven, Values::Real(coherence), form)?;
                }
                if let Some(folding) = &entry.folding {
                    let words = std::array::from_fn(|line| match line {
                        0 => FOLDING.to_owned(),
                        1 => "relative error of the receptance by aliasing".to_owned(),
                        _ => String::new(),
                    });
                    let header = beside(words, Function::General);
                    write_set(out, &header, uneven, Values::Real(folding), form)?;
                }
            }
            Ok(())
        })?;
        Ok(())
    }

    /// First frequency and line spacing of an evenly spaced table, Hz, both rounded to seven digits. `None` if they
    /// miss a frequency of the table by more than 0.001 line spacings, or if the table has one line.
    fn even(&self) -> Option<(f64, f64)> {
        let (&first, &last) = (self.frequency_hz().first()?, self.frequency_hz().last()?);
        let count = self.frequency_hz().len();
        if count < 2 {
            return None;
        }
        let seven = |value: f64| format!("{value:.6e}").parse::<f64>().unwrap_or(value);
        let (first, step) = (seven(first), seven((last - first) / (count - 1) as f64));
        let is_even = self
            .frequency_hz()
            .iter()
            .enumerate()
            .all(|(index, hertz)| (hertz - first - step * index as f64).abs() <= 1e-3 * step);
        is_even.then_some((first, step))
    }
}

fn header(entry: &Frf, even: Option<(f64, f64)>) -> Header {
    let dof = |direction: Direction| DegreeOfFreedom {
        entity: String::new(),
        node: 1,
        direction: direction.axis().map_or(0, |axis| axis as i64 + 1),
    };
    Header {
        words: [
            format!("h{}", entry.name()),
            "receptance of the tool centre point".into(),
            String::new(),
            String::new(),
            String::new(),
        ],
        function: Function::FrequencyResponse,
        response: dof(entry.response),
        reference: dof(entry.force),
        ordinate_type: OrdinateType {
            is_double: true,
            is_complex: true,
        },
        count: entry.receptance.len(),
        even,
        abscissa: Axis {
            kind: 18,
            exponents: [0, 0],
            unit: "Hz".into(),
        },
        ordinate: axis_of(Quantity::Displacement),
        denominator: axis_of(Quantity::Force),
    }
}
