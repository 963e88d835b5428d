//! Options of `--method mode-shapes`: the points of the recordings.

/// Points of the force and of the sensor in the recordings of a roving test.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Points of a roving test")]
pub(super) struct PointOptions {
    /// Point of the force in each recording, in their order, such as 1,2,3,4,5; one for all. Default: what the key `at` of the force channels in the
    /// sidecars, --map COLUMN=fx@POINT or the nodes of UFF files state.
    #[arg(long, value_name = "POINT,…", value_delimiter = ',')]
    pub(super) force_at: Vec<String>,
    /// Point of the sensor in each recording, likewise.
    #[arg(long, value_name = "POINT,…", value_delimiter = ',')]
    pub(super) sensor_at: Vec<String>,
}
