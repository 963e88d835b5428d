//! Answers of the user to `quietcut setup`.

use std::num::NonZeroU8;

use serde::Deserialize;

use crate::cli::{angle, count, finite, positive};

/// Answers of the user about the machine, the tool and the cut, given by options or by a file; each may be missing.
#[derive(Clone, Debug, Default, clap::Args, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields, default)]
pub(super) struct Given {
    /// Name of the machine and job. Default: the name of the folder.
    #[arg(long, value_name = "TEXT")]
    pub(super) name: Option<String>,
    /// The machine, such as its type; a comment in the case.
    #[arg(long, value_name = "TEXT")]
    pub(super) machine: Option<String>,
    /// The tool holder; a comment in the case.
    #[arg(long, value_name = "TEXT")]
    pub(super) holder: Option<String>,
    /// The sensor and where it sits; a comment in the case.
    #[arg(long, value_name = "TEXT")]
    pub(super) sensor: Option<String>,
    /// Number of teeth.
    #[arg(long, value_name = "N", value_parser = count)]
    pub(super) teeth: Option<NonZeroU8>,
    /// Diameter of the tool in mm.
    #[arg(long, value_name = "D", value_parser = positive)]
    pub(super) diameter_mm: Option<f64>,
    /// Edge angle in degrees; 90 is a square end mill. Default: 90.
    #[arg(long, value_name = "D", value_parser = angle)]
    pub(super) edge_angle_deg: Option<f64>,
    /// Class of materials, one of the list of --materials, whose coefficients lie in a range.
    #[arg(long, value_name = "NAME", conflicts_with = "ktc_mpa")]
    pub(super) material: Option<String>,
    /// Tangential cutting coefficient in MPa, instead of --material.
    #[arg(long, value_name = "K", value_parser = positive)]
    pub(super) ktc_mpa: Option<f64>,
    /// Radial cutting coefficient in MPa. Default: 0.3 of the tangential one; a comment in the case then says so.
    #[arg(long, value_name = "K", value_parser = finite, requires = "ktc_mpa", allow_negative_numbers = true)]
    pub(super) krc_mpa: Option<f64>,
    /// Axial cutting coefficient in MPa. Default: 0.
    #[arg(long, value_name = "K", value_parser = finite, requires = "ktc_mpa", allow_negative_numbers = true)]
    pub(super) kac_mpa: Option<f64>,
    /// Standard deviation of the tangential cutting coefficient in MPa; the stability limits then get a probability
    /// band.
    #[arg(long, value_name = "S", value_parser = positive, requires = "ktc_mpa")]
    pub(super) ktc_mpa_std: Option<f64>,
    /// Radial depth in mm of a down-milling cut.
    #[arg(long, value_name = "AE", value_parser = positive, conflicts_with_all = ["up_milling_mm", "slot"])]
    pub(super) down_milling_mm: Option<f64>,
    /// Radial depth in mm of an up-milling cut, instead of --down-milling-mm.
    #[arg(long, value_name = "AE", value_parser = positive, conflicts_with = "slot")]
    pub(super) up_milling_mm: Option<f64>,
    /// The cut is a slot.
    #[arg(long)]
    pub(super) slot: bool,
    /// Feed per tooth in mm.
    #[arg(long, value_name = "F", value_parser = positive)]
    pub(super) feed_per_tooth_mm: Option<f64>,
    /// Lowest and highest spindle speed in rev/min, FIRST:LAST. Advice stays between them.
    #[arg(long, value_name = "FIRST:LAST")]
    pub(super) rpm: Option<String>,
    /// Power of the spindle in W.
    #[arg(long, value_name = "W", value_parser = positive)]
    pub(super) power_w: Option<f64>,
    /// Torque of the spindle in N·m.
    #[arg(long, value_name = "NM", value_parser = positive)]
    pub(super) torque_nm: Option<f64>,
}
