//! Frame in which a cell's loads are given and read.

use didim_dynamics::robot::{NamedFrame, NoSuchFrame};
use didim_identification::identification::{Finding, Note};

use super::Cell;

/// Frame of a load, and whether a person has named it.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadFrame {
    /// The frame on the last link.
    pub frame: NamedFrame,
    /// True if `--frame` or the cell names the frame. Given centres are then in it, and otherwise
    /// in the model's frame of the last link, as in earlier versions.
    pub is_named: bool,
}

impl Cell {
    /// Returns the frame of loads: the link of this name, or that of `frame` in `[payload]`.
    /// Without either it is the frame of the link that the last joint moves.
    ///
    /// # Errors
    /// [`NoSuchFrame`].
    pub fn load_frame(&self, link: Option<&str>) -> Result<LoadFrame, NoSuchFrame> {
        let name = link.or(self.payload.frame.as_deref());
        let frame = self.robot.load_frame(name)?;
        Ok(LoadFrame { frame, is_named: name.is_some() })
    }
}

impl LoadFrame {
    /// Returns a given centre in the frame of the last link, with which the model computes \[m\].
    pub fn centre_in_link(&self, centre_m: [f64; 3]) -> [f64; 3] {
        if self.is_named { self.frame.point_in_link(centre_m) } else { centre_m }
    }

    /// Returns the finding on a given centre without a named frame, if the frames differ.
    pub fn findings(&self, has_centre: bool) -> Vec<Finding> {
        if !has_centre || self.is_named || self.frame.is_model_frame() {
            return Vec::new();
        }
        Finding::from_notes(&[Note::LoadFrame { link: self.frame.name.clone() }])
    }
}
