//! JSON values whose numbers keep their text, so that two values can be compared to the bit.

/// A JSON value. A map keeps its keys in the order of the text.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Json {
    /// No value.
    Null,
    /// A truth value.
    Bool(bool),
    /// A number, as its text.
    Number(String),
    /// A string, with its escapes resolved.
    Text(String),
    /// Values in order.
    List(Vec<Json>),
    /// Values by key.
    Map(Vec<(String, Json)>),
}

impl Json {
    /// Parses `text`, which must be exactly one value.
    pub(crate) fn read(text: &str) -> Result<Self, String> {
        let mut reader = Reader {
            bytes: text.as_bytes(),
            at: 0,
        };
        let value = reader.value()?;
        reader.blanks();
        if reader.at < reader.bytes.len() {
            return Err(format!("text after the value at byte {}", reader.at));
        }
        Ok(value)
    }

    /// The value of a key of a map.
    pub(crate) fn get(&self, key: &str) -> Option<&Self> {
        match self {
            Self::Map(entries) => entries.iter().find(|(k, _)| k == key).map(|(_, v)| v),
            _ => None,
        }
    }

    /// The number; `None` if the value is no number.
    pub(crate) fn number(&self) -> Option<f64> {
        match self {
            Self::Number(text) => text.parse().ok(),
            _ => None,
        }
    }

    /// The string; `None` if the value is no string.
    pub(crate) fn text(&self) -> Option<&str> {
        match self {
            Self::Text(text) => Some(text),
            _ => None,
        }
    }

    /// Largest magnitude of all numbers in a list and its nested lists.
    pub(crate) fn largest(&self) -> f64 {
        match self {
            Self::List(values) => values.iter().map(Self::largest).fold(0.0, f64::max),
            _ => self.number().map_or(0.0, f64::abs),
        }
    }

    /// The value as text with line breaks. A list without maps is written in one line.
    pub(crate) fn write(&self) -> String {
        let mut text = String::new();
        self.append(&mut text, 0);
        text
    }

    fn append(&self, out: &mut String, depth: usize) {
        match self {
            Self::Null => out.push_str("null"),
            Self::Bool(value) => out.push_str(if *value { "true" } else { "false" }),
            Self::Number(text) => out.push_str(text),
            Self::Text(text) => quoted(text, out),
            Self::List(values) => {
                let flat = !values.iter().any(Self::has_map);
                out.push('[');
                for (i, value) in values.iter().enumerate() {
                    if i > 0 {
                        out.push(',');
                    }
                    if !flat {
                        line(out, depth + 1);
                    }
                    value.append(out, depth + 1);
                }
                if !flat {
                    line(out, depth);
                }
                out.push(']');
            }
            Self::Map(entries) => {
                out.push('{');
                for (i, (key, value)) in entries.iter().enumerate() {
                    if i > 0 {
                        out.push(',');
                    }
                    line(out, depth + 1);
                    quoted(key, out);
                    out.push_str(": ");
                    value.append(out, depth + 1);
                }
                if !entries.is_empty() {
                    line(out, depth);
                }
                out.push('}');
            }
        }
    }

    fn has_map(&self) -> bool {
        match self {
            Self::Map(_) => true,
            Self::List(values) => values.iter().any(Self::has_map),
            _ => false,
        }
    }
}

fn line(out: &mut String, depth: usize) {
    out.push('\n');
    out.extend(std::iter::repeat_n(' ', depth));
}

fn quoted(text: &str, out: &mut String) {
    out.push('"');
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            '\n' => out.push_str("\\n"),
            '\t' => out.push_str("\\t"),
            c if u32::from(c) < 0x20 => out.push_str(&format!("\\u{:04x}", u32::from(c))),
            c => out.push(c),
        }
    }
    out.push('"');
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Reader<'_> {
    fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    fn blanks(&mut self) {
        while self.peek().is_some_and(|b| b.is_ascii_whitespace()) {
            self.at += 1;
        }
    }

    fn take(&mut self, byte: u8) -> Result<(), String> {
        self.blanks();
        if self.peek() != Some(byte) {
            return Err(format!("no '{}' at byte {}", char::from(byte), self.at));
        }
        self.at += 1;
        Ok(())
    }

    fn value(&mut self) -> Result<Json, String> {
        self.blanks();
        match self.peek() {
            Some(b'{') => self.map(),
            Some(b'[') => self.list(),
            Some(b'"') => self.string().map(Json::Text),
            Some(_) => self.word(),
            None => Err("the text ends within a value".to_owned()),
        }
    }

    fn word(&mut self) -> Result<Json, String> {
        let from = self.at;
        while self
            .peek()
            .is_some_and(|b| b.is_ascii_alphanumeric() || b"+-.".contains(&b))
        {
            self.at += 1;
        }
        let word = String::from_utf8_lossy(&self.bytes[from..self.at]).into_owned();
        match word.as_str() {
            "null" => Ok(Json::Null),
            "true" => Ok(Json::Bool(true)),
            "false" => Ok(Json::Bool(false)),
            _ if word.parse::<f64>().is_ok_and(f64::is_finite) => Ok(Json::Number(word)),
            _ => Err(format!("'{word}' at byte {from} is no value")),
        }
    }

    fn list(&mut self) -> Result<Json, String> {
        self.take(b'[')?;
        let mut values = Vec::new();
        loop {
            self.blanks();
            match self.peek() {
                Some(b']') => break,
                _ if values.is_empty() => {}
                _ => self.take(b',')?,
            }
            values.push(self.value()?);
        }
        self.take(b']')?;
        Ok(Json::List(values))
    }

    fn map(&mut self) -> Result<Json, String> {
        self.take(b'{')?;
        let mut entries = Vec::new();
        loop {
            self.blanks();
            match self.peek() {
                Some(b'}') => break,
                _ if entries.is_empty() => {}
                _ => self.take(b',')?,
            }
            self.blanks();
            let key = self.string()?;
            self.take(b':')?;
            entries.push((key, self.value()?));
        }
        self.take(b'}')?;
        Ok(Json::Map(entries))
    }

    fn string(&mut self) -> Result<String, String> {
        self.take(b'"')?;
        let mut bytes = Vec::new();
        loop {
            let byte = self.peek().ok_or("the text ends within a string")?;
            self.at += 1;
            match byte {
                b'"' => break,
                b'\\' => {
                    let escape = self.peek().ok_or("the text ends within a string")?;
                    self.at += 1;
                    let c = match escape {
                        b'n' => '\n',
                        b't' => '\t',
                        b'r' => '\r',
                        b'b' => '\u{8}',
                        b'f' => '\u{c}',
                        b'u' => self.code()?,
                        other => char::from(other),
                    };
                    bytes.extend(c.to_string().bytes());
                }
                _ => bytes.push(byte),
            }
        }
        String::from_utf8(bytes).map_err(|error| error.to_string())
    }

    fn code(&mut self) -> Result<char, String> {
        let digits = self
            .bytes
            .get(self.at..self.at + 4)
            .ok_or("the text ends within a string")?;
        self.at += 4;
        let digits = String::from_utf8_lossy(digits);
        let code = u32::from_str_radix(&digits, 16).map_err(|error| error.to_string())?;
        Ok(char::from_u32(code).unwrap_or(char::REPLACEMENT_CHARACTER))
    }
}
