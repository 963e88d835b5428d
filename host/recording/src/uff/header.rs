//! The eleven records before the data of a data set 58, and the first line of its binary form.

/// Type of the numbers of the ordinate, record 7.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OrdinateType {
    /// 8 bytes each instead of 4.
    pub is_double: bool,
    /// Real and imaginary part.
    pub is_complex: bool,
}

/// What a function is, record 6. Only those that are used have a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Function {
    /// 0: general or unknown.
    General,
    /// 1: a record over time.
    Time,
    /// 4: frequency response function.
    FrequencyResponse,
    /// 6: coherence.
    Coherence,
    /// Any other.
    Other(i64),
}

impl Function {
    pub(super) fn of_code(code: i64) -> Self {
        match code {
            0 => Self::General,
            1 => Self::Time,
            4 => Self::FrequencyResponse,
            6 => Self::Coherence,
            other => Self::Other(other),
        }
    }

    /// The number by which a file names it.
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

/// A degree of freedom, record 6.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Freedom {
    /// Name of the entity, up to ten characters; empty for none.
    pub entity: String,
    /// Number of the node.
    pub node: i64,
    /// 0 scalar; ±1, ±2, ±3 along x, y, z; ±4, ±5, ±6 about them.
    pub direction: i64,
}

/// What an axis shows, records 8 to 11.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Axis {
    /// Specific data type: 8 displacement, 11 velocity, 12 acceleration, 13 excitation force, 17 time …
    pub kind: i64,
    /// Exponents of the units of length and force.
    pub exponents: [i64; 2],
    /// The unit in words; empty for none.
    pub unit: String,
}

/// The records before the data.
#[derive(Clone, Debug, PartialEq)]
pub struct Header {
    /// Five lines of words.
    pub words: [String; 5],
    /// Which function of the two ends it holds.
    pub function: Function,
    /// Where and along which axis the response was measured.
    pub response: Freedom,
    /// Where and along which axis the reference was measured.
    pub reference: Freedom,
    /// Precision of the values, and whether they are complex.
    pub ordinate_type: OrdinateType,
    /// Number of values.
    pub count: usize,
    /// First abscissa and step, where it is even.
    pub even: Option<(f64, f64)>,
    /// The quantity along the abscissa.
    pub abscissa: Axis,
    /// The quantity along the ordinate; of a ratio, its numerator.
    pub ordinate: Axis,
    /// The denominator of a ratio.
    pub denominator: Axis,
}

/// Number of records of text.
pub(super) const RECORDS: usize = 11;

impl Header {
    /// Reads the eleven records.
    ///
    /// # Errors
    /// The index of the record, from 0, and what is wrong with it.
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

/// Record 6: `2(I5,I10), 2(1X,A10,I10,I4)`.
fn degrees_of_freedom(record: &str) -> Result<(Function, Freedom, Freedom), String> {
    let function = match field(record, 0, 5) {
        // Some writers do not keep to the columns.
        text if text.contains(' ') => record.split_whitespace().next().unwrap_or_default(),
        text => text,
    };
    let function: i64 = function.parse().map_err(|_| {
        format!("function type \"{function}\"; a number, such as 1 for time or 4 for an FRF, is needed")
    })?;
    let freedom = |at: usize| -> Result<Freedom, String> {
        Ok(Freedom {
            entity: named(field(record, at + 1, 10)),
            node: whole(field(record, at + 11, 10), "node")?,
            direction: whole(field(record, at + 21, 4), "direction")?,
        })
    };
    // Without columns there are ten words.
    let in_columns = freedom(30).and_then(|response| Ok((response, freedom(55)?)));
    let (response, reference) = match (
        in_columns,
        record.split_whitespace().collect::<Vec<_>>().as_slice(),
    ) {
        (Ok(both), _) => both,
        (Err(_), &[_, _, _, _, a, b, c, d, e, f]) => {
            let freedom = |entity: &str, node, direction| -> Result<Freedom, String> {
                Ok(Freedom {
                    entity: named(entity),
                    node: whole(node, "node")?,
                    direction: whole(direction, "direction")?,
                })
            };
            (freedom(a, b, c)?, freedom(d, e, f)?)
        }
        (Err(what), _) => return Err(what),
    };
    for freedom in [&response, &reference] {
        if !(-6..=6).contains(&freedom.direction) {
            return Err(format!("direction {}; -6 to 6 is possible", freedom.direction));
        }
    }
    Ok((Function::of_code(function), response, reference))
}

/// Type, number of values, and the even abscissa.
type DataForm = (OrdinateType, usize, Option<(f64, f64)>);

/// Record 7: `3I10, 3E13.5`.
fn data_form(record: &str) -> Result<DataForm, String> {
    let fields = [
        field(record, 0, 10),
        field(record, 10, 10),
        field(record, 20, 10),
        field(record, 30, 13),
        field(record, 43, 13),
    ];
    // Words instead of columns, where a writer did not keep to them.
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
    // Ten columns hold no more.
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

/// Records 8 to 11: `I10, 3I5, 2(1X,A20)`.
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

/// The first line of a binary data set: `I6, A1, I6, I6, I12, I12, …`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Binary {
    pub(super) is_big_endian: bool,
    /// Lines of text that follow.
    pub(super) lines: usize,
    /// Bytes of data that follow them; 0 where the writer did not know.
    pub(super) bytes: u64,
}

impl Binary {
    /// Reads what stands after `58b`.
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

/// Characters `from .. from + length` of a record, without blanks around; empty where the record is shorter.
fn field(record: &str, from: usize, length: usize) -> &str {
    let at = |index: usize| {
        record
            .char_indices()
            .nth(index)
            .map_or(record.len(), |(offset, _)| offset)
    };
    record[at(from)..at(from + length)].trim()
}

/// A name; `NONE` is none.
fn named(text: &str) -> String {
    let text = text.trim();
    if text.eq_ignore_ascii_case("none") {
        String::new()
    } else {
        text.into()
    }
}

/// A whole number; an empty field is 0, as Fortran reads it.
fn whole(text: &str, what: &str) -> Result<i64, String> {
    if text.is_empty() {
        return Ok(0);
    }
    text.parse()
        .map_err(|_| format!("{what} \"{text}\"; a whole number is needed"))
}

/// A number; an empty field is 0, as Fortran reads it.
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
