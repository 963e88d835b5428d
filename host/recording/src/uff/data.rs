//! Reader of the data (values) of a UFF data set 58, as text or binary.

use std::io::BufRead;

use num_complex::Complex;

use super::fault::{Fault, fault};
use super::header::{Binary, Header};
use super::number;
use super::source::{Source, SourceError};

/// Largest number of values of a UFF data set for which memory is reserved before they are read. A choice; it bounds
/// the cost of a false count in the header.
const TRUSTED: usize = 1 << 16;

/// Number of values of a binary UFF data set that are read at once; a choice.
const CHUNK: usize = 1 << 13;

/// Ordinate values of a function.
#[derive(Clone, Debug, PartialEq)]
pub enum Ordinate {
    /// Real values.
    Real(Vec<f64>),
    /// Complex values.
    Complex(Vec<Complex<f64>>),
}

impl Ordinate {
    /// Number of values.
    pub fn len(&self) -> usize {
        match self {
            Self::Real(values) => values.len(),
            Self::Complex(values) => values.len(),
        }
    }

    /// True if the data set holds no values.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Data of a UFF data set 58: the ordinate values, and the abscissa values if these are unevenly spaced.
pub(super) struct Data {
    pub(super) uneven: Option<Vec<f64>>,
    pub(super) ordinate: Ordinate,
}

/// Distributes the sequence of numbers in a UFF data set to abscissa, real part and imaginary part.
struct Sorter {
    data: Data,
    /// Role of the next number that is read from the data set: 0 abscissa, 1 real part, 2 imaginary part.
    next: u8,
    /// Real part of the complex value whose imaginary part is the next number in the data set.
    real: f64,
}

impl Sorter {
    fn new(header: &Header) -> Self {
        let room = header.count.min(TRUSTED);
        let ordinate = if header.ordinate_type.is_complex {
            Ordinate::Complex(Vec::with_capacity(room))
        } else {
            Ordinate::Real(Vec::with_capacity(room))
        };
        let uneven = header.even.is_none().then(|| Vec::with_capacity(room));
        Self {
            next: u8::from(uneven.is_none()),
            data: Data { uneven, ordinate },
            real: 0.0,
        }
    }

    /// Stores the next number of the data set as abscissa, real part or imaginary part.
    fn take(&mut self, value: f64) {
        let first = u8::from(self.data.uneven.is_none());
        match (self.next, &mut self.data.ordinate, &mut self.data.uneven) {
            (0, _, Some(uneven)) => {
                uneven.push(value);
                self.next = 1;
            }
            (2, Ordinate::Complex(values), _) => {
                values.push(Complex::new(self.real, value));
                self.next = first;
            }
            (_, Ordinate::Complex(_), _) => {
                self.real = value;
                self.next = 2;
            }
            (_, Ordinate::Real(values), _) => {
                values.push(value);
                self.next = first;
            }
        }
    }
}

/// Count of stored numbers per value of a UFF function: 1 for a real ordinate, 2 for a complex one, plus 1 if the
/// abscissa is stored.
fn per_value(header: &Header) -> usize {
    1 + usize::from(header.ordinate_type.is_complex) + usize::from(header.even.is_none())
}

/// Reads the values of a UFF data set 58 written as text, up to and including its final delimiter, a line `-1`.
///
/// A line `-1` is read as a number if values are still missing and the lines after it show that the data set continues.
pub(super) fn read_text<R: BufRead>(source: &mut Source<R>, header: &Header) -> Result<Data, Fault> {
    let missing = |found: usize, line: u64| {
        let per = per_value(header);
        fault(
            line,
            format!("the data end after {} of {} values", found / per, header.count),
        )
    };
    let expected = header.count.checked_mul(per_value(header));
    let mut sorter = Sorter::new(header);
    let mut found = 0;
    let mut numbers = Vec::with_capacity(8);
    while let Some(line) = source.next()? {
        if line.is_blank() {
            continue;
        }
        let is_complete = Some(found) == expected;
        if line.is_delimiter() {
            if is_complete {
                return Ok(sorter.data);
            }
            let is_last = expected.and_then(|expected| expected.checked_sub(found)) == Some(1);
            if ends_here(source, is_last)? {
                return Err(missing(found, line.number));
            }
        } else if is_complete {
            return Err(fault(
                line.number,
                format!(
                    "\"{}\" after all {} values; a line -1 is needed there",
                    line.text().trim(),
                    header.count
                ),
            ));
        }
        numbers.clear();
        number::append(&line.bytes, &mut numbers).map_err(|what| fault(line.number, what))?;
        found += numbers.len();
        if expected.is_some_and(|expected| found > expected) {
            return Err(fault(
                line.number,
                format!(
                    "more numbers than the {} values that record 7 states",
                    header.count
                ),
            ));
        }
        numbers.iter().for_each(|&value| sorter.take(value));
    }
    // The last delimiter of a UFF file may be missing: a complete data set may end with the file.
    if Some(found) == expected {
        Ok(sorter.data)
    } else {
        Err(missing(found, source.line()))
    }
}

/// True if a line `-1` within the values is the final delimiter of a data set that lacks numbers, and not the value −1;
/// `is_last` says that exactly one number is missing.
fn ends_here<R: BufRead>(source: &mut Source<R>, is_last: bool) -> Result<bool, SourceError> {
    match source.peek_filled(0)? {
        None => return Ok(true),
        Some(next) if !next.is_delimiter() => return Ok(false),
        Some(_) => {}
    }
    Ok(match source.peek_filled(1)? {
        None => !is_last,
        // The number of a UFF data set ends in column six. A value rarely has a digit in this column, so that the
        // column tells a number of a data set from a value.
        Some(second) => {
            second.bytes.get(5).is_some_and(u8::is_ascii_digit) && second.number_of_set().is_some()
        }
    })
}

/// Reads the values of a binary UFF data set, up to and including its final delimiter.
pub(super) fn read_binary<R: BufRead>(
    source: &mut Source<R>,
    header: &Header,
    binary: Binary,
) -> Result<Data, Fault> {
    let line = source.line();
    let widths = widths(header, binary);
    let stride: usize = widths.iter().sum();
    let mut sorter = Sorter::new(header);
    let mut buffer = vec![0; stride * CHUNK.min(header.count.max(1))];
    let mut rest = header.count;
    while rest > 0 {
        let values = rest.min(CHUNK);
        let bytes = &mut buffer[..values * stride];
        source.fill(bytes).map_err(|error| match error {
            SourceError::Io(error) => Fault::Io(error),
            SourceError::Ends { found } => fault(
                line,
                format!(
                    "the file ends after {} of {} binary values",
                    header.count - rest + found / stride,
                    header.count
                ),
            ),
        })?;
        let mut at = 0;
        for _ in 0..values {
            for &width in &widths {
                sorter.take(decode(&bytes[at..at + width], binary.is_big_endian));
                at += width;
            }
        }
        rest -= values;
    }
    let needed = stride as u64 * header.count as u64;
    source.skip(binary.bytes.saturating_sub(needed))?;
    let end = end_of_binary(source);
    if binary.bytes != 0 && binary.bytes < needed && matches!(end, Err(Fault::Line { .. })) {
        return Err(fault(
            line,
            format!(
                "{} bytes of data, but {} values of this type need {needed}, and no line -1 stands after as many",
                binary.bytes, header.count
            ),
        ));
    }
    end?;
    Ok(sorter.data)
}

/// Sizes, bytes, of the numbers that a binary UFF data set stores for one function value, in order: abscissa, real
/// part, imaginary part.
///
/// The standard stores the abscissa of double-precision ordinates in single precision. Some writers store it in double
/// precision; the byte count in the header distinguishes the two.
///
/// More bytes than the values need are padding. Some writers state the bytes of a complex function as if it were real:
/// where fewer are stated than needed, the line `-1` after the values decides.
fn widths(header: &Header, binary: Binary) -> Vec<usize> {
    let width = if header.ordinate_type.is_double { 8 } else { 4 };
    let mut widths = vec![width; per_value(header)];
    let bytes = |widths: &[usize]| widths.iter().sum::<usize>() as u64 * header.count as u64;
    if header.even.is_none() && header.ordinate_type.is_double && binary.bytes != bytes(&widths) {
        widths[0] = 4;
    }
    widths
}

/// Decodes an IEEE 754 number of 4 or 8 bytes.
fn decode(bytes: &[u8], is_big_endian: bool) -> f64 {
    macro_rules! number {
        ($type:ty) => {{
            let mut array = [0; size_of::<$type>()];
            array.copy_from_slice(bytes);
            if is_big_endian {
                <$type>::from_be_bytes(array)
            } else {
                <$type>::from_le_bytes(array)
            }
        }};
    }
    if bytes.len() == 4 {
        f64::from(number!(f32))
    } else {
        number!(f64)
    }
}

/// Reads the delimiter line `-1` that ends a binary UFF data set: directly after the data, or after a line end and
/// empty lines. The delimiter may be missing at the end of the file.
fn end_of_binary<R: BufRead>(source: &mut Source<R>) -> Result<(), Fault> {
    match source.peek_filled(0)? {
        None => return Ok(()),
        Some(line) if line.is_delimiter() => {}
        Some(line) => {
            let shown: String = line.text().chars().take(40).collect();
            return Err(fault(
                line.number,
                format!(
                    "\"{}\" after binary data; a line -1 is needed there",
                    shown.escape_debug()
                ),
            ));
        }
    }
    while let Some(line) = source.next()? {
        if line.is_delimiter() {
            break;
        }
    }
    Ok(())
}
