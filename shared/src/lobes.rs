//! The lobe table: where this machine is stable.
//!
//! A table holds, for layers of feed per tooth, immersion and posture and for a grid of spindle speeds, the
//! depths of cut that are *not* stable. It is a `.qct` file on the host and the same bytes in the device's flash;
//! [`LobeTable`] reads it where it lies, without a copy.
//!
//! ```text
//! depth │      ▓▓▓▓▓ Hopf ▓▓▓▓▓▓        one column: [ flip 1.58 .. 2.33 ) [ Hopf 2.71 .. end of the table ]
//!       │▓▓▓▓           ░░░░░▓▓▓        first limit of the column: 1.58, a flip
//!       │▓▓▓    ▒▒ ← flip   ░▓▓▓        an island is an interval that ends below the end of the table
//!       │▓▓     ▒▒         ▓▓▓▓
//!       └───────┬┬──────────────── speed
//! ```
//!
//! What the table answers for a point between its entries:
//! - *Speed*: the two neighbouring columns are joined. Where they have the same sequence of overlapping intervals of the
//!   same kinds, ends and chatter frequencies are interpolated linearly; where they differ (an island begins, a
//!   kind changes), a depth is unstable where it is unstable in either column.
//! - *Feed per tooth*: the same between the two neighbouring layers. A layer may hold for a range of feeds.
//! - *Feed direction*: where layers are for some directions, the same between the two around it, if they are at most
//!   [`FEED_DIRECTION_SPAN`] apart and their feeds need no interpolation. A direction that was not told is that of the layers where
//!   they have only one.
//! - *Immersion and posture*: never interpolated. Immersion may differ by [`IMMERSION_TOLERANCE`], posture must be the same.
//! - Outside, the answer is [`TabulatedStability::NotKnown`] with the reason, never a guess.
//!
//! A table may say how large the [`InterpolationError`] is, and how its limits move with what the device learns:
//! [`LobeTable::slopes`], [`corrected_limit`].
//!
//! Linear interpolation lies above a limit that is convex between two grid speeds by up to h²·b″/8 (h the
//! step of the grid, b″ the curvature of the limit): who computes a table chooses the grid so that this is small
//! against the margin of [`advice`](crate::advice).
//!
//! [`format`] documents the bytes.

mod additions;
mod bytes;
mod check;
mod column;
mod correction;
mod cut;
mod encode;
mod error;
pub mod format;
mod half;
mod header;
mod interval;
mod shape;
mod slopes;
mod table;
mod tabulated_stability;
mod tolerance;
mod validity;

pub use additions::{Additions, InterpolationError};
pub use column::Column;
pub use cut::CutLobes;
pub(crate) use cut::FEW;
pub use encode::{Content, Layer, encode, encode_with, encoded_length, encoded_length_with};
pub use error::TableError;
pub use header::Header;
pub use interval::{Interval, IntervalKind};
pub use slopes::{IntervalSlopes, LayerMode, Learned, MODES_MAX, Slopes, corrected_limit};
pub use table::LobeTable;
pub use tabulated_stability::{NotKnown, TabulatedStability};
pub use tolerance::{FEED_DIRECTION_SPAN, FEED_DIRECTION_TOLERANCE, FEED_TOLERANCE, IMMERSION_TOLERANCE};
pub use validity::Validity;
