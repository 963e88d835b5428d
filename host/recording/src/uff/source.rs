//! Sequential reader of text lines and binary data from one UFF file.

use std::collections::VecDeque;
use std::io::BufRead;

/// One line of a UFF file, without its line end.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Line {
    /// Number of the line in the file, from 1; line feeds within binary data count, too.
    pub(super) number: u64,
    /// Content of the line.
    pub(super) bytes: Vec<u8>,
}

impl Line {
    /// Content of the line as text; bytes that are not UTF-8 become replacement characters.
    pub(super) fn text(&self) -> String {
        String::from_utf8_lossy(&self.bytes).into_owned()
    }

    /// True if the line holds only blanks.
    pub(super) fn is_blank(&self) -> bool {
        self.bytes.iter().all(u8::is_ascii_whitespace)
    }

    /// True if the line is the delimiter that begins and ends a UFF data set: `-1` alone.
    pub(super) fn is_delimiter(&self) -> bool {
        self.bytes.trim_ascii() == b"-1"
    }

    /// Number of the UFF data set that the line begins, and the text after the number; `None` if the line has no such
    /// form.
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

/// Error of reading lines or bytes from a UFF file.
#[derive(Debug)]
pub(super) enum SourceError {
    /// Error of the operating system.
    Io(std::io::Error),
    /// The UFF file ends before all required bytes are read.
    Ends {
        /// Number of bytes that were read before the file ended.
        found: usize,
    },
}

/// Reader of the lines and the binary data of a UFF file, which can look at lines ahead.
pub(super) struct Source<R> {
    reader: R,
    /// Lines that are already read from the file for looking ahead, but not yet returned.
    ahead: VecDeque<Line>,
    /// Number of the last line read from the file, lines read ahead included.
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

    /// Number of the last line that the reader returned, from 1; 0 before the first.
    pub(super) fn line(&self) -> u64 {
        self.ahead.front().map_or(self.line, |line| line.number - 1)
    }

    /// Returns the next line of the UFF file; `None` at the end of the file.
    pub(super) fn next(&mut self) -> Result<Option<Line>, SourceError> {
        match self.ahead.pop_front() {
            Some(line) => Ok(Some(line)),
            None => self.fetch(),
        }
    }

    /// Looks ahead at the next non-blank line after `before` other non-blank lines, without consuming any line; `None`
    /// if the file ends before it.
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

    /// Reads one more line from the UFF file into memory; `None` at its end.
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

    /// Reads bytes until `buffer` is full. No line that was looked at ahead may be pending.
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

    /// Skips `bytes` bytes.
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
