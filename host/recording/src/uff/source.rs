//! A file as lines and bytes by turns, read as it goes: a long record is never held twice.

use std::collections::VecDeque;
use std::io::BufRead;

/// One line, without its end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Line {
    /// From 1. Line ends within binary data count as well.
    pub(super) number: u64,
    /// What stands in it.
    pub(super) bytes: Vec<u8>,
}

impl Line {
    /// The text; bytes that are none become replacement characters.
    pub(super) fn text(&self) -> String {
        String::from_utf8_lossy(&self.bytes).into_owned()
    }

    /// Nothing but blanks.
    pub(super) fn is_blank(&self) -> bool {
        self.bytes.iter().all(u8::is_ascii_whitespace)
    }

    /// The mark that begins and ends a data set: `-1` and nothing else.
    pub(super) fn is_mark(&self) -> bool {
        self.bytes.trim_ascii() == b"-1"
    }

    /// The number of a data set, and what stands after it; `None` where the line is no first line of one.
    pub(super) fn number_of_set(&self) -> Option<(u32, String)> {
        let text = self.text();
        let text = text.trim();
        let digits = text.bytes().take_while(u8::is_ascii_digit).count();
        let (number, rest) = text.split_at(digits);
        let is_alone = rest.is_empty() || rest.starts_with([' ', 'b', 'B']);
        number
            .parse()
            .ok()
            .filter(|_| is_alone)
            .map(|number| (number, rest.into()))
    }
}

/// What can go wrong with lines and bytes.
#[derive(Debug)]
pub(super) enum SourceError {
    /// The system says so.
    Io(std::io::Error),
    /// The file ends where more bytes are needed.
    Ends {
        /// Bytes that were there.
        found: usize,
    },
}

/// A reader of lines and bytes.
pub(super) struct Source<R> {
    reader: R,
    /// Lines that were looked at and not taken.
    ahead: VecDeque<Line>,
    /// Number of the last line that was read from the file.
    line: u64,
}

impl<R: BufRead> Source<R> {
    pub(super) fn new(reader: R) -> Self {
        Self {
            reader,
            ahead: VecDeque::new(),
            line: 0,
        }
    }

    /// Number of the line that was taken last.
    pub(super) fn line(&self) -> u64 {
        self.ahead.front().map_or(self.line, |line| line.number - 1)
    }

    /// The next line; `None` at the end of the file.
    pub(super) fn next(&mut self) -> Result<Option<Line>, SourceError> {
        match self.ahead.pop_front() {
            Some(line) => Ok(Some(line)),
            None => self.fetch(),
        }
    }

    /// The line that is not blank and has `before` such lines before it; all of them stay to be taken.
    pub(super) fn peek_filled(&mut self, before: usize) -> Result<Option<&Line>, SourceError> {
        let mut filled = self.ahead.iter().filter(|line| !line.is_blank()).count();
        while filled <= before {
            let Some(line) = self.fetch()? else {
                return Ok(None);
            };
            filled += usize::from(!line.is_blank());
            self.ahead.push_back(line);
        }
        Ok(self.ahead.iter().filter(|line| !line.is_blank()).nth(before))
    }

    fn fetch(&mut self) -> Result<Option<Line>, SourceError> {
        let mut bytes = Vec::new();
        let read = self
            .reader
            .read_until(b'\n', &mut bytes)
            .map_err(SourceError::Io)?;
        if read == 0 {
            return Ok(None);
        }
        self.line += 1;
        if bytes.last() == Some(&b'\n') {
            bytes.pop();
        }
        if bytes.last() == Some(&b'\r') {
            bytes.pop();
        }
        Ok(Some(Line {
            number: self.line,
            bytes,
        }))
    }

    /// The next bytes, which fill `buffer`. No line may have been looked at.
    pub(super) fn fill(&mut self, buffer: &mut [u8]) -> Result<(), SourceError> {
        debug_assert!(self.ahead.is_empty());
        let mut found = 0;
        while found < buffer.len() {
            match self.reader.read(&mut buffer[found..]) {
                Ok(0) => return Err(SourceError::Ends { found }),
                Ok(read) => found += read,
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                Err(error) => return Err(SourceError::Io(error)),
            }
        }
        self.line += buffer.iter().filter(|&&byte| byte == b'\n').count() as u64;
        Ok(())
    }

    /// Passes over so many bytes.
    pub(super) fn skip(&mut self, bytes: u64) -> Result<(), SourceError> {
        let mut rest = bytes;
        let mut buffer = [0; 4096];
        while rest > 0 {
            let length = rest.min(buffer.len() as u64) as usize;
            self.fill(&mut buffer[..length])?;
            rest -= length as u64;
        }
        Ok(())
    }
}
