//! Structure of a case file in TOML, before its values are checked.

use std::collections::BTreeMap;

use serde::Deserialize;
use toml::Spanned;

/// A number with its position in the case file, for messages.
pub(super) type Number = Spanned<f64>;
/// A matrix by rows, with its position in the case file, for messages.
pub(super) type Rows = Spanned<Vec<Vec<f64>>>;

/// Tables `[extension.NAME]` by name; names, keys and values with their positions in the case file.
pub(super) type ExtensionsFile = BTreeMap<Spanned<String>, BTreeMap<Spanned<String>, Spanned<toml::Value>>>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CaseFile {
    pub(super) name: Option<String>,
    pub(super) structure: Option<Spanned<StructureFile>>,
    pub(super) tool: Option<ToolFile>,
    pub(super) material: Option<MaterialFile>,
    pub(super) cut: Option<CutFile>,
    pub(super) limits: Option<LimitsFile>,
    pub(super) posture: Option<PostureFile>,
    pub(super) uncertainty: Option<UncertaintyFile>,
    pub(super) provenance: Option<ProvenanceFile>,
    #[serde(default)]
    pub(super) extension: ExtensionsFile,
}

/// Section `[structure]` with the keys of all kinds of structure; the key `kind` decides which of them are allowed.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StructureFile {
    pub(super) kind: Spanned<String>,
    pub(super) directions: Spanned<Vec<String>>,
    pub(super) rpm: Option<Number>,
    pub(super) at_speed: Option<Vec<Spanned<AtSpeedFile>>>,
    pub(super) mass: Option<Rows>,
    pub(super) mass_std: Option<Rows>,
    pub(super) damping: Option<Rows>,
    pub(super) damping_std: Option<Rows>,
    pub(super) stiffness: Option<Rows>,
    pub(super) stiffness_std: Option<Rows>,
    pub(super) cubic_damping: Option<Rows>,
    pub(super) cubic_damping_std: Option<Rows>,
    pub(super) cubic_stiffness: Option<Rows>,
    pub(super) cubic_stiffness_std: Option<Rows>,
    pub(super) mode: Option<Vec<Spanned<ModeFile>>>,
    pub(super) tool_m: Option<Spanned<[f64; 3]>>,
    pub(super) joint: Option<Vec<Spanned<JointFile>>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct JointFile {
    pub(super) axis: Spanned<[f64; 3]>,
    pub(super) point_m: Spanned<[f64; 3]>,
    pub(super) stiffness_nm_per_rad: Number,
    pub(super) stiffness_nm_per_rad_std: Option<Number>,
    pub(super) damping_nms_per_rad: Number,
    pub(super) damping_nms_per_rad_std: Option<Number>,
    pub(super) cubic_stiffness_nm_per_rad3: Option<Number>,
    pub(super) cubic_stiffness_nm_per_rad3_std: Option<Number>,
    pub(super) cubic_damping_nms3_per_rad3: Option<Number>,
    pub(super) cubic_damping_nms3_per_rad3_std: Option<Number>,
    pub(super) rotor_kg_m2: Option<Number>,
    pub(super) mass_kg: Number,
    pub(super) mass_kg_std: Option<Number>,
    pub(super) center_m: Spanned<[f64; 3]>,
    pub(super) inertia_kg_m2: Spanned<Vec<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ModeFile {
    pub(super) frequency_hz: Number,
    pub(super) frequency_hz_std: Option<Number>,
    pub(super) damping_ratio: Number,
    pub(super) damping_ratio_std: Option<Number>,
    pub(super) left: Spanned<Vec<[f64; 2]>>,
    pub(super) left_std: Option<Spanned<Vec<[f64; 2]>>>,
    pub(super) right: Spanned<Vec<[f64; 2]>>,
    pub(super) right_std: Option<Spanned<Vec<[f64; 2]>>>,
}

/// Table `[[structure.at_speed]]`: the modes at a further spindle speed.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AtSpeedFile {
    pub(super) rpm: Number,
    #[serde(default)]
    pub(super) mode: Vec<ModeAtSpeedFile>,
}

/// Table `[[structure.at_speed.mode]]`. The deviations of `[[structure.mode]]` hold at all speeds.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ModeAtSpeedFile {
    pub(super) frequency_hz: Number,
    pub(super) damping_ratio: Number,
    pub(super) left: Spanned<Vec<[f64; 2]>>,
    pub(super) right: Spanned<Vec<[f64; 2]>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ToolFile {
    pub(super) teeth: Spanned<i64>,
    pub(super) edge_angle_deg: Number,
    pub(super) edge_angle_deg_std: Option<Number>,
    pub(super) diameter_mm: Option<Number>,
    pub(super) pitch_deg: Option<Spanned<Vec<f64>>>,
    pub(super) runout_um: Option<Number>,
    pub(super) runout_um_std: Option<Number>,
    pub(super) runout_angle_deg: Option<Number>,
    pub(super) runout_angle_deg_std: Option<Number>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MaterialFile {
    pub(super) ktc_mpa: Number,
    pub(super) ktc_mpa_std: Option<Number>,
    pub(super) krc_mpa: Number,
    pub(super) krc_mpa_std: Option<Number>,
    pub(super) kac_mpa: Number,
    pub(super) kac_mpa_std: Option<Number>,
    pub(super) kte_n_per_mm: Option<Number>,
    pub(super) kte_n_per_mm_std: Option<Number>,
    pub(super) kre_n_per_mm: Option<Number>,
    pub(super) kre_n_per_mm_std: Option<Number>,
    pub(super) kae_n_per_mm: Option<Number>,
    pub(super) kae_n_per_mm_std: Option<Number>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CutFile {
    pub(super) start_deg: Number,
    pub(super) start_deg_std: Option<Number>,
    pub(super) exit_deg: Number,
    pub(super) exit_deg_std: Option<Number>,
    pub(super) feed_per_tooth_mm: Number,
    pub(super) feed_per_tooth_mm_std: Option<Number>,
    pub(super) feed_direction_deg: Option<Number>,
    pub(super) feed_direction_deg_std: Option<Number>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LimitsFile {
    pub(super) rpm_min: Number,
    pub(super) rpm_max: Number,
    pub(super) ranges_rpm: Option<Spanned<Vec<[f64; 2]>>>,
    pub(super) power_w: Option<Number>,
    pub(super) torque_nm: Option<Number>,
    pub(super) power_curve_rpm_w: Option<Spanned<Vec<[f64; 2]>>>,
    pub(super) torque_curve_rpm_nm: Option<Spanned<Vec<[f64; 2]>>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PostureFile {
    pub(super) index: Option<Spanned<i64>>,
    pub(super) joints_deg: Option<Spanned<Vec<f64>>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct UncertaintyFile {
    pub(super) parameters: Spanned<Vec<Spanned<String>>>,
    pub(super) covariance: Spanned<Vec<Spanned<Vec<f64>>>>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ProvenanceFile {
    #[serde(default)]
    pub(super) assumed: Vec<String>,
    #[serde(default)]
    pub(super) zero_receptances: Vec<Spanned<String>>,
}
