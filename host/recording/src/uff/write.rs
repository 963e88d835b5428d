//! Writer of UFF data sets 58: ordinate values as text with 13 digits, or as binary doubles.

use std::io::{self, Write};

use num_complex::Complex;

use super::header::{Axis, DegreeOfFreedom, Function, Header, OrdinateType, RECORDS};
use super::units::kind;
use crate::{Channel, Quantity, Recording};

/// Form of the data in a written UFF file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UffForm {
    /// Text.
    #[default]
    Text,
    /// Binary form 58b: little-endian IEEE 754 doubles.
    Binary,
}

/// Ordinate values to write.
#[derive(Clone, Copy, Debug)]
pub enum Values<'a> {
    /// Real values.
    Real(&'a [f64]),
    /// Complex values.
    Complex(&'a [Complex<f64>]),
}

impl Values<'_> {
    fn len(self) -> usize {
        match self {
            Self::Real(values) => values.len(),
            Self::Complex(values) => values.len(),
        }
    }
}

/// Writes UFF data set 164, which states that the file is in SI units.
pub fn write_units(out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "    -1\n   164")?;
    writeln!(out, "{:10}{:<20}{:10}", 1, "SI: Meter (newton)", 2)?;
    let one = exponential(1.0, 17, 25);
    writeln!(out, "{one}{one}{one}\n{}\n    -1", exponential(273.15, 17, 25))
}

/// UFF header for one channel of a recording.
pub(super) fn header_of(recording: &Recording, channel: &Channel) -> Header {
    let direction = match channel.name.as_bytes() {
        [.., b'x'] => 1,
        [.., b'y'] => 2,
        [.., b'z'] => 3,
        _ => 0,
    };
    // Only a standard channel name, such as `ax`, defines a direction: the x at the end of "matrix" does not.
    let is_by_convention = Quantity::of_name(&channel.name) == Some(channel.quantity);
    let sensor = recording
        .sidecar
        .channels
        .get(&channel.name)
        .and_then(|said| said.at.clone());
    Header {
        words: [
            channel.name.clone(),
            sensor.unwrap_or_default(),
            String::new(),
            String::new(),
            String::new(),
        ],
        function: Function::Time,
        response: DegreeOfFreedom {
            entity: channel.name.clone(),
            node: 1,
            direction: if is_by_convention { direction } else { 0 },
        },
        reference: DegreeOfFreedom::default(),
        ordinate_type: OrdinateType {
            is_double: true,
            is_complex: false,
        },
        count: channel.samples.len(),
        even: Some((recording.start_s, 1.0 / recording.sample_rate_hz)),
        abscissa: axis_of(Quantity::Time),
        ordinate: axis_of(channel.quantity),
        denominator: Axis::default(),
    }
}

/// Header entries of an axis that holds a quantity in its SI unit.
pub fn axis_of(quantity: Quantity) -> Axis {
    Axis {
        kind: kind(quantity),
        exponents: match quantity {
            Quantity::Displacement | Quantity::Velocity | Quantity::Acceleration => [1, 0],
            Quantity::Force => [0, 1],
            Quantity::Pressure => [-2, 1],
            _ => [0, 0],
        },
        unit: match quantity {
            Quantity::Unknown => String::new(),
            other => other.unit().into(),
        },
    }
}

/// Writes a UFF data set 58; `uneven` are the abscissa values if the header states no even spacing.
pub fn write_set(
    out: &mut dyn Write,
    header: &Header,
    uneven: Option<&[f64]>,
    values: Values<'_>,
    form: UffForm,
) -> io::Result<()> {
    let numbers = 1 + usize::from(uneven.is_some()) + usize::from(matches!(values, Values::Complex(_)));
    let bytes = 8 * numbers * values.len();
    match form {
        UffForm::Text => writeln!(out, "    -1\n    58")?,
        UffForm::Binary => {
            writeln!(out, "    -1")?;
            writeln!(
                out,
                "    58b{:6}{:6}{RECORDS:12}{bytes:12}{:6}{:6}{:12}{:12}",
                1, 2, 0, 0, 0, 0
            )?;
        }
    }
    write_header(out, header, values.len())?;
    match form {
        UffForm::Text => write_text(out, uneven, values)?,
        UffForm::Binary => write_binary(out, uneven, values)?,
    }
    writeln!(out, "    -1")
}

/// Writes the eleven header records.
fn write_header(out: &mut dyn Write, header: &Header, count: usize) -> io::Result<()> {
    for words in &header.words {
        writeln!(out, "{:<80}", cut(none(words), 80))?;
    }
    write!(out, "{:5}{:10}{:5}{:10}", header.function.code(), 0, 0, 0)?;
    for dof in [&header.response, &header.reference] {
        let entity = cut(none(&dof.entity), 10);
        write!(out, " {entity:<10}{:10}{:4}", dof.node, dof.direction)?;
    }
    let OrdinateType { is_complex, .. } = header.ordinate_type;
    let (first, step) = header.even.unwrap_or((0.0, 0.0));
    writeln!(
        out,
        "\n{:10}{count:10}{:10}{}{}{}",
        if is_complex { 6 } else { 4 },
        u8::from(header.even.is_some()),
        // The field of 13 columns has space for one digit more than the standard format E13.5 uses, so that the first
        // abscissa value and the step lose less.
        exponential(first, 6, 13),
        exponential(step, 6, 13),
        exponential(0.0, 6, 13),
    )?;
    for axis in [
        &header.abscissa,
        &header.ordinate,
        &header.denominator,
        &Axis::default(),
    ] {
        writeln!(
            out,
            "{:10}{:5}{:5}{:5} {:<20} {:<20}",
            axis.kind,
            axis.exponents[0],
            axis.exponents[1],
            0,
            "NONE",
            cut(none(&axis.unit), 20)
        )?;
    }
    Ok(())
}

/// Writes the data as text.
fn write_text(out: &mut dyn Write, uneven: Option<&[f64]>, values: Values<'_>) -> io::Result<()> {
    let value = |index: usize| match values {
        Values::Real(values) => exponential(values[index], 12, 20),
        Values::Complex(values) => {
            exponential(values[index].re, 12, 20) + &exponential(values[index].im, 12, 20)
        }
    };
    // The number of values per line follows the formats of the UFF standard: 4E20.12 (real), 2(E13.5,E20.12) (real with
    // abscissa), E13.5,2E20.12 (complex with abscissa).
    let per_line = match (values, uneven) {
        (Values::Real(_), None) => 4,
        (Values::Real(_), Some(_)) | (Values::Complex(_), None) => 2,
        (Values::Complex(_), Some(_)) => 1,
    };
    for first in (0..values.len()).step_by(per_line) {
        for index in first..values.len().min(first + per_line) {
            if let Some(abscissa) = uneven {
                write!(out, "{}", exponential(abscissa[index], 6, 13))?;
            }
            write!(out, "{}", value(index))?;
        }
        writeln!(out)?;
    }
    Ok(())
}

/// Writes the values of a UFF data set as little-endian doubles.
fn write_binary(out: &mut dyn Write, uneven: Option<&[f64]>, values: Values<'_>) -> io::Result<()> {
    for index in 0..values.len() {
        if let Some(abscissa) = uneven {
            out.write_all(&abscissa[index].to_le_bytes())?;
        }
        match values {
            Values::Real(values) => out.write_all(&values[index].to_le_bytes())?,
            Values::Complex(values) => {
                out.write_all(&values[index].re.to_le_bytes())?;
                out.write_all(&values[index].im.to_le_bytes())?;
            }
        }
    }
    writeln!(out)
}

/// Formats a number like Fortran `Ewidth.digits`, with one digit before the point and at least two exponent digits.
pub(super) fn exponential(value: f64, digits: usize, width: usize) -> String {
    let text = format!("{value:.digits$E}");
    let text = match text.split_once('E') {
        Some((mantissa, exponent)) => {
            let (sign, size) = exponent
                .strip_prefix('-')
                .map_or(('+', exponent), |size| ('-', size));
            format!("{mantissa}E{sign}{size:0>2}")
        }
        None => text,
    };
    format!("{text:>width$}")
}

/// `NONE` for an empty text.
fn none(text: &str) -> &str {
    if text.is_empty() { "NONE" } else { text }
}

/// Truncates a text of a UFF header to `length` characters; control characters become blanks.
fn cut(text: &str, length: usize) -> String {
    text.chars()
        .map(|letter| if letter.is_control() { ' ' } else { letter })
        .take(length)
        .collect()
}
