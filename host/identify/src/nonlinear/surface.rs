//! Restoring-force surface of a record, with a force or of a free decay.

use super::free_decay;
use super::restoring_force::{Options, Record, Surface, SurfaceError};

impl Record<'_> {
    /// Fits the force law to the record and computes its restoring-force surface.
    ///
    /// # Errors
    /// See [`SurfaceError`].
    pub fn surface(&self, options: &Options) -> Result<Surface, SurfaceError> {
        if self.is_free() {
            let mass_kg = options.mass_kg.ok_or(SurfaceError::NoForce)?;
            return free_decay::surface(self, options, mass_kg);
        }
        self.driven_surface(options)
    }
}
