//! Header of a UFF data set 58: its eleven records, and the first line of the binary form 58b.

/// Number type of the ordinate of a UFF function (record 7).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OrdinateType {
    /// True if the ordinate is stored in double precision (8 bytes), false if in single precision (4 bytes).
    pub is_double: bool,
    /// True for complex values.
    pub is_complex: bool,
}

/// Function type of a UFF data set 58 (record 6); only the types used here have a variant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Function {
    /// Type 0: general or unknown.
    General,
    /// Type 1: time history.
    Time,
    /// Type 4: frequency response function.
    FrequencyResponse,
    /// Type 6: coherence.
    Coherence,
    /// A function type that has no variant here, with its code in record 6.
    Other(i64),
}

impl Function {
    /// UFF function type that a code in record 6 stands for.
    pub(super) fn of_code(code: i64) -> Self {
        match code {
            0 => Self::General,
            1 => Self::Time,
            4 => Self::FrequencyResponse,
            6 => Self::Coherence,
            other => Self::Other(other),
        }
    }

    /// Code of the UFF function type in record 6.
    pub fn code(self) -> i64 {
        match self {
            Self::General => 0,
            Self::Time => 1,
            Self::FrequencyResponse => 4,
            Self::Coherence => 6,
            Self::Other(code) => code,
        }
    }
}

/// Degree of freedom of the response or the reference of a UFF function (record 6): node and direction.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DegreeOfFreedom {
    /// Name of the measured entity at this degree of freedom, ten characters at most by the standard; empty if there is
    /// none.
    pub entity: String,
    /// Node number.
    pub node: i64,
    /// Direction of the degree of freedom: 0 scalar; ±1, ±2, ±3 translation along ±x, ±y, ±z; ±4, ±5, ±6 rotation about
    /// them.
    pub direction: i64,
}

/// Quantity and unit of an axis of a UFF function (records 8 to 11).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Axis {
    /// Code of the quantity of the axis (specific data type): 8 displacement, 11 velocity, 12 acceleration, 13
    /// excitation force, 17 time, 18 frequency …
    pub kind: i64,
    /// Exponents of length and of force in the unit of the axis.
    pub exponents: [i64; 2],
    /// Text of the unit of the axis; empty if there is none.
    pub unit: String,
}

/// Header (records 1 to 11) of a UFF data set 58.
#[derive(Clone, Debug, PartialEq)]
pub struct Header {
    /// Five lines of free text at the start of a UFF header (records 1 to 5).
    pub words: [String; 5],
    /// Function type of the data set, such as time history or frequency response.
    pub function: Function,
    /// Degree of freedom of the measured response.
    pub response: DegreeOfFreedom,
    /// Degree of freedom of the reference; in a frequency response function that of the force.
    pub reference: DegreeOfFreedom,
    /// Precision of the ordinate values, and whether they are complex.
    pub ordinate_type: OrdinateType,
    /// Number of values.
    pub count: usize,
    /// First value and step of an evenly spaced abscissa; `None` if the spacing is uneven.
    pub even: Option<(f64, f64)>,
    /// Abscissa: quantity and unit.
    pub abscissa: Axis,
    /// Quantity and unit of the ordinate; of a ratio such as response per force, those of the numerator.
    pub ordinate: Axis,
    /// Quantity and unit of the denominator, if the ordinate is a ratio such as response per force.
    pub denominator: Axis,
}

/// Number of header records of a data set 58 (UFF standard).
pub(super) const RECORDS: usize = 11;

impl Header {
    /// Parses the first ten of the eleven header records of a UFF data set 58; the last one is not used.
    ///
    /// # Errors
    /// Index of the faulty record, from 0, and a description of the fault.
    pub(super) fn parse(records: &[String; RECORDS]) -> Result<Self, (usize, String)> {
        let words = std::array::from_fn(|index| named(&records[index]));
        let (function, response, reference) = degrees_of_freedom(&records[5]).map_err(|what| (5, what))?;
        let (ordinate_type, count, even) = data_form(&records[6]).map_err(|what| (6, what))?;
        let axis = |index: usize| axis(&records[index]).map_err(|what| (index, what));
        Ok(Self {
            words,
            function,
            response,
            reference,
            ordinate_type,
            count,
            even,
            abscissa: axis(7)?,
            ordinate: axis(8)?,
            denominator: axis(9)?,
        })
    }
}

/// Parses record 6 of a UFF header, Fortran format `2(I5,I10), 2(1X,A10,I10,I4)`: function type, response and
/// reference.
fn degrees_of_freedom(record: &str) -> Result<(Function, DegreeOfFreedom, DegreeOfFreedom), String> {
    let function = match field(record, 0, 5) {
        // Some writers ignore the column positions of record 6; the first word is then the function type.
        text if text.contains(' ') => record.split_whitespace().next().unwrap_or_default(),
        text => text,
    };
    let function: i64 = function.parse().map_err(|_| {
        format!("function type \"{function}\"; a number, such as 1 for time or 4 for an FRF, is needed")
    })?;
    let dof = |at: usize| -> Result<DegreeOfFreedom, String> {
        Ok(DegreeOfFreedom {
            entity: named(field(record, at + 1, 10)),
            node: whole(field(record, at + 11, 10), "node")?,
            direction: whole(field(record, at + 21, 4), "direction")?,
        })
    };
    // A record 6 that ignores the column positions has ten words separated by blanks.
    let in_columns = dof(30).and_then(|response| Ok((response, dof(55)?)));
    let (response, reference) = match (
        in_columns,
        record.split_whitespace().collect::<Vec<_>>().as_slice(),
    ) {
        (Ok(both), _) => both,
        (Err(_), &[_, _, _, _, a, b, c, d, e, f]) => {
            let dof = |entity: &str, node, direction| -> Result<DegreeOfFreedom, String> {
                Ok(DegreeOfFreedom {
                    entity: named(entity),
                    node: whole(node, "node")?,
                    direction: whole(direction, "direction")?,
                })
            };
            (dof(a, b, c)?, dof(d, e, f)?)
        }
        (Err(what), _) => return Err(what),
    };
    for dof in [&response, &reference] {
        if !(-6..=6).contains(&dof.direction) {
            return Err(format!("direction {}; -6 to 6 is possible", dof.direction));
        }
    }
    Ok((Function::of_code(function), response, reference))
}

/// Content of record 7 of a UFF header: number type, number of values, first value and step of an evenly spaced
/// abscissa.
type DataForm = (OrdinateType, usize, Option<(f64, f64)>);

/// Parses record 7 of a UFF header, Fortran format `3I10, 3E13.5`.
fn data_form(record: &str) -> Result<DataForm, String> {
    let fields = [
        field(record, 0, 10),
        field(record, 10, 10),
        field(record, 20, 10),
        field(record, 30, 13),
        field(record, 43, 13),
    ];
    // If record 7 cannot be parsed by column positions, its words separated by blanks are parsed.
    let words: Vec<&str> = record.split_whitespace().collect();
    parse_data_form(fields).or_else(|what| match words.as_slice() {
        &[a, b, c, d, e, ..] => parse_data_form([a, b, c, d, e]),
        _ => Err(what),
    })
}

fn parse_data_form([kind, count, spacing, first, step]: [&str; 5]) -> Result<DataForm, String> {
    let (is_double, is_complex) = match kind {
        "2" => (false, false),
        "4" => (true, false),
        "5" => (false, true),
        "6" => (true, true),
        other => {
            return Err(format!(
                "ordinate data type \"{other}\"; 2, 4, 5 or 6 (single and double, real and complex) is needed"
            ));
        }
    };
    // The number of values stands in ten columns of the record, so it has at most ten digits.
    let count = match count.parse::<usize>() {
        Ok(count) if count < 10_000_000_000 => count,
        _ => {
            return Err(format!(
                "number of values \"{count}\"; a whole number of up to ten digits is needed"
            ));
        }
    };
    let even = match spacing {
        "0" => None,
        "1" => {
            let first = real(first, "first abscissa")?;
            let step = real(step, "step of the abscissa")?;
            if step <= 0.0 {
                return Err(format!("step of the abscissa {step}; it must be greater than 0"));
            }
            Some((first, step))
        }
        other => {
            return Err(format!(
                "abscissa spacing \"{other}\"; 0 for uneven or 1 for even is needed"
            ));
        }
    };
    Ok((
        OrdinateType {
            is_double,
            is_complex,
        },
        count,
        even,
    ))
}

/// Parses one of the records 8 to 10 of a UFF header, Fortran format `I10, 3I5, 2(1X,A20)`: quantity and unit of an
/// axis.
fn axis(record: &str) -> Result<Axis, String> {
    Ok(Axis {
        kind: whole(field(record, 0, 10), "specific data type")?,
        exponents: [
            whole(field(record, 10, 5), "exponent of length")?,
            whole(field(record, 15, 5), "exponent of force")?,
        ],
        unit: named(field(record, 47, 20)),
    })
}

/// First line of a binary UFF data set, Fortran format `I6, A1, I6, I6, I12, I12, …`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Binary {
    pub(super) is_big_endian: bool,
    /// Number of header lines that follow the first line of a binary data set.
    pub(super) lines: usize,
    /// Length of the binary data of the data set, bytes; 0 if the writer did not state it.
    pub(super) bytes: u64,
}

impl Binary {
    /// Parses the text after `58b`.
    pub(super) fn parse(rest: &str) -> Result<Self, String> {
        let words: Vec<&str> = rest.split_whitespace().collect();
        let &[order, format, lines, bytes, ..] = words.as_slice() else {
            return Err(format!(
                "\"58b{rest}\"; byte order, number format, lines and bytes are needed after it"
            ));
        };
        let is_big_endian = match order {
            "1" => false,
            "2" => true,
            other => return Err(format!("byte order \"{other}\"; 1 (little) or 2 (big) is needed")),
        };
        if format != "2" {
            return Err(format!(
                "floating-point format \"{format}\"; only 2 (IEEE 754) is read, not DEC (1) and IBM (3)"
            ));
        }
        let lines: usize = whole(lines, "number of lines")?.try_into().unwrap_or(0);
        if lines != 0 && lines < RECORDS {
            return Err(format!("{lines} lines of text; {RECORDS} are needed"));
        }
        let bytes = u64::try_from(whole(bytes, "number of bytes")?)
            .map_err(|_| format!("number of bytes \"{bytes}\"; it cannot be negative"))?;
        Ok(Self {
            is_big_endian,
            lines: lines.max(RECORDS),
            bytes,
        })
    }
}

/// Text in the columns `from .. from + length` of a UFF record, counted from 0, trimmed; empty if the record ends
/// before them.
fn field(record: &str, from: usize, length: usize) -> &str {
    let at = |index: usize| {
        record
            .char_indices()
            .nth(index)
            .map_or(record.len(), |(offset, _)| offset)
    };
    record[at(from)..at(from + length)].trim()
}

/// Trimmed text of a name in a UFF header; `NONE` means no name and becomes the empty string.
fn named(text: &str) -> String {
    let text = text.trim();
    if text.eq_ignore_ascii_case("none") {
        String::new()
    } else {
        text.into()
    }
}

/// Parses an integer field of a UFF record; an empty field is 0, as in Fortran.
fn whole(text: &str, what: &str) -> Result<i64, String> {
    if text.is_empty() {
        return Ok(0);
    }
    text.parse()
        .map_err(|_| format!("{what} \"{text}\"; a whole number is needed"))
}

/// Parses a finite real field of a UFF record; an empty field is 0, as in Fortran.
fn real(text: &str, what: &str) -> Result<f64, String> {
    let mut values = Vec::new();
    if text.is_empty() {
        return Ok(0.0);
    }
    match super::number::append(text.as_bytes(), &mut values) {
        Ok(()) if values.len() == 1 && values[0].is_finite() => Ok(values[0]),
        _ => Err(format!("{what} \"{text}\"; a number is needed")),
    }
}
