//! The lobe table: stability lobes of one machine and tool.
//!
//! A table holds, for layers of feed per tooth, feed direction, immersion and posture and for a grid of spindle speeds,
//! the depth intervals that are *not* stable. It is a `.qct` file on the host and the same bytes in the device's flash;
//! [`LobeTable`] reads these bytes in place, without a copy.
//!
//! ```text
//! depth │      ▓▓▓▓▓ Hopf ▓▓▓▓▓▓        one column: [ flip 1.58 .. 2.33 ) [ Hopf 2.71 .. end of the table ]
//!       │▓▓▓▓           ░░░░░▓▓▓        first limit of the column: 1.58, a flip
//!       │▓▓▓    ▒▒ ← flip   ░▓▓▓        an island is an interval that ends below the end of the table
//!       │▓▓     ▒▒         ▓▓▓▓
//!       └───────┬┬──────────────── speed
//! ```
//!
//! Lookup between the entries:
//! - *Speed*: the two neighbouring columns are combined, each group of overlapping or touching intervals by itself. If
//!   the group has the same sequence of kinds in both columns and the intervals overlap pairwise, interval ends and
//!   chatter frequencies are interpolated linearly. Otherwise (an island begins, the kind changes) a depth is unstable
//!   if it is unstable in either column.
//! - *Feed per tooth*: the same rule between the two neighbouring layers. A layer may be valid for a range of feeds.
//! - *Feed direction*: layers may be valid for one direction only. Between two such directions the same rule applies,
//!   if they are at most [`FEED_DIRECTION_SPAN`] apart and the feed needs no interpolation. If no direction is set
//!   and all layers of the immersion and posture that have a direction have the same one, this direction is assumed.
//! - *Immersion and posture*: never interpolated. Immersion angles may differ by [`IMMERSION_TOLERANCE`]; the posture
//!   must be equal.
//! - *Outside the table*: the result is [`TabulatedStability::NotKnown`] with the reason; nothing is extrapolated.
//!
//! A table may contain a bound of its [`InterpolationError`], and the derivatives of its limits by modal parameters
//! and cutting force ([`LobeTable::slopes`]), from which [`corrected_limit`] follows.
//!
//! Between two grid speeds, linear interpolation exceeds a convex limit b(n) by up to h²·b″/8 (h the speed step, b″ the
//! second derivative by speed). The speed grid of a table must keep this small against the margin of
//! [`advice`](crate::advice).
//!
//! [`format`] specifies the bytes.

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
mod validity;

pub use crate::criteria::{
    FEED_DIRECTION_SPAN, FEED_DIRECTION_TOLERANCE, FEED_TOLERANCE, IMMERSION_TOLERANCE,
};
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
pub use validity::Validity;
