//! What people read: words, pictures, the HTML report, lines on a terminal.

pub mod answer;
pub mod words;
