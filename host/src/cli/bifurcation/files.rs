//! Files that `quietcut bifurcation --out` writes: picture, page, JSON and table.

use std::path::Path;

use super::super::Error;
use super::answer::BifurcationOutput;
use super::computed::Computed;
use super::names::word;
use super::request::Request;
use super::strobe::StrobeSet;
use super::summary::{fixed, text};
use crate::file;
use crate::report::branch_chart::{Strobe, branch_chart};
use crate::report::curve_chart::{CurveAxis, curve_chart};
use crate::report::page::{figure, page};

impl<'a> From<&'a StrobeSet> for Strobe<'a> {
    fn from(set: &'a StrobeSet) -> Self {
        Self {
            value: set.value,
            displacement_mm: &set.displacement_mm,
        }
    }
}

/// Results with the name of their case.
pub(super) struct Shown<'a> {
    pub(super) name: &'a str,
    pub(super) request: &'a Request,
    pub(super) teeth: usize,
    pub(super) computed: &'a Computed,
}

impl Shown<'_> {
    /// Writes the file `path` in the format of its ending.
    ///
    /// # Errors
    /// The chart cannot be drawn, or the file cannot be written.
    pub(super) fn write(&self, path: &Path) -> Result<(), Error> {
        let text = match file::ending(path).as_str() {
            "json" => {
                let answer = BifurcationOutput::new(self.request, self.teeth, self.computed);
                serde_json::to_string(&answer).map_err(Error::other)?
            }
            "csv" => self.as_csv()?,
            "svg" => match self.curves()? {
                Some(curves) => curves,
                None => self.branch()?,
            },
            _ => self.page()?,
        };
        Ok(file::write(path, text.as_bytes())?)
    }

    fn branch(&self) -> Result<String, Error> {
        let title = format!("{}, {}", self.name, fixed(self.request));
        let strobe: Vec<Strobe<'_>> = self.computed.strobe.iter().map(Strobe::from).collect();
        let doubled = self.computed.doubled_branches();
        branch_chart(
            &title,
            &self.computed.branch,
            &doubled,
            self.request.range,
            &strobe,
        )
        .map_err(Error::input)
    }

    /// Chart of the curves, if there are any.
    fn curves(&self) -> Result<Option<String>, Error> {
        let Some(asked) = &self.request.curves else {
            return Ok(None);
        };
        let plane = asked.shown.map(|parameter| CurveAxis {
            parameter,
            range: asked.plane.ranges[usize::from(asked.plane.parameters[1] == parameter)],
        });
        let kinds: Vec<&str> = asked.kinds.iter().map(|kind| word(*kind)).collect();
        let title = format!("{}, {} of forced orbits", self.name, kinds.join(" and "));
        let drawn = curve_chart(&title, &self.computed.curves, plane);
        drawn.map(Some).map_err(Error::input)
    }

    fn page(&self) -> Result<String, Error> {
        let caption = "Amplitude (half peak-to-peak) of the forced orbits. Solid: stable; dashed: unstable. Points: bifurcations; the \
                       ring marks the first loss of stability. Shaded: a period-doubled vibration is stable beside the forced one.";
        let of_curves = "Bifurcations over two parameters. Solid: the orbits are stable on one side of the curve; dashed: they are unstable \
                         on both. 1:3 and 1:4: strong resonances.";
        let body = maud::html! {
            h1 { (self.name) ": bifurcations of forced orbits" }
            (figure(&self.branch()?, caption))
            @if let Some(curves) = self.curves()? { (figure(&curves, of_curves)) }
            pre { (text(self.request, self.teeth, self.computed)) }
        };
        Ok(page(self.name, &body))
    }

    /// One row for each orbit of the branch, in its order.
    fn as_csv(&self) -> Result<String, Error> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let header = [
            self.request.vary.key(),
            "amplitude_feed_mm",
            "amplitude_normal_mm",
            "amplitude_axial_mm",
            "multiplier_abs",
            "unstable_multipliers",
        ];
        writer.write_record(header).map_err(Error::other)?;
        for point in &self.computed.branch.points {
            let [feed, normal, axial] = point.amplitude_mm;
            let row = [point.value, feed, normal, axial, point.multiplier_abs].map(|value| value.to_string());
            let outside = point.outside.to_string();
            let row = row.iter().map(String::as_str).chain([outside.as_str()]);
            writer.write_record(row).map_err(Error::other)?;
        }
        let bytes = writer
            .into_inner()
            .map_err(|error| Error::other(error.to_string()))?;
        String::from_utf8(bytes).map_err(Error::other)
    }
}
