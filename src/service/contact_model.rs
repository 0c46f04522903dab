//! The result whose model explains the torques of a running service.

use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use didim_formats::Side;
use didim_identification::identification::Use;

use crate::analysis::StoredModel;
use crate::archive::store::{LATEST_FILE, number_of_result, result_file};
use crate::cell::{Cell, ContactSection};
use crate::live::external_torque::{ModelSource, ObserverModel};

/// Maximum number of older results that are tried at the start if the newest is not usable.
const OLDER_RESULTS: u64 = 20;

/// Identity of a file and of its content: device, inode, size and time of change.
type FileIdentity = (u64, u64, u64, i64, i64);

/// Returns the source of a service's models: the file that the cell names, or the newest result in
/// the state folder that is usable for prediction.
pub(super) fn model_source(
    cell: &Cell,
    contact: &ContactSection,
    state: Option<&Path>,
) -> ModelSource {
    let mut follower = Follower {
        cell: cell.clone(),
        bandwidth_hz: contact.bandwidth_hz,
        file: contact.result.clone().or_else(|| Some(state?.join(LATEST_FILE))),
        is_named: contact.result.is_some(),
        seen: None,
        has_model: false,
    };
    Box::new(move || follower.next())
}

/// Follows a result file.
struct Follower {
    cell: Cell,
    bandwidth_hz: Option<f64>,
    file: Option<PathBuf>,
    /// True if the cell names the file.
    is_named: bool,
    /// The file as it was read last; `Some(None)` if it was missing.
    seen: Option<Option<FileIdentity>>,
    has_model: bool,
}

impl Follower {
    /// Returns the observer of the file if it has changed since the last call.
    fn next(&mut self) -> Option<Result<ObserverModel, String>> {
        let file = self.file.clone()?;
        let identity = fs::metadata(&file)
            .ok()
            .map(|of| (of.dev(), of.ino(), of.size(), of.mtime(), of.mtime_nsec()));
        if self.seen.replace(identity) == Some(identity) {
            return None;
        }
        // A service without results waits for one.
        if identity.is_none() && !self.is_named {
            return None;
        }
        let found = if self.is_named { self.read(&file, None) } else { self.newest(&file) };
        self.has_model |= found.is_ok();
        Some(found)
    }

    /// Reads the newest result. At the start an earlier one serves if the newest is not usable.
    fn newest(&self, link: &Path) -> Result<ObserverModel, String> {
        let file = fs::read_link(link).map_err(|error| format!("{}: {error}", link.display()))?;
        let number = number_of_result(&file);
        let number = number.ok_or_else(|| format!("{} leads to no result", link.display()))?;
        let folder = link.parent().unwrap_or(Path::new(""));
        let newest = self.read(&result_file(folder, number), Some(number));
        if newest.is_ok() || self.has_model {
            return newest;
        }
        let earlier = (number.saturating_sub(OLDER_RESULTS)..number).rev();
        earlier
            .map(|number| self.read(&result_file(folder, number), Some(number)))
            .find(Result::is_ok)
            .unwrap_or(newest)
    }

    /// Creates the observer of a result. A file that the cell names need not be usable for
    /// prediction: the person who named it decides.
    fn read(&self, file: &Path, number: Option<u64>) -> Result<ObserverModel, String> {
        let read = StoredModel::read_stored_model(file, self.cell.clone());
        let (model, cell) = read.map_err(|error| error.to_string())?;
        let judged = model.judged_use(Use::Prediction);
        let is_usable = judged.is_some_and(|of| of.applicable == Some(true));
        if number.is_some() && !is_usable {
            let why = judged.and_then(crate::analysis::JudgedUse::objection);
            let why = why.unwrap_or_else(|| "it has no verdict on prediction".to_owned());
            return Err(format!("{}: {why}", file.display()));
        }
        let observer = model.observer(&cell, Side::Motor, self.bandwidth_hz);
        let observer = observer.map_err(|error| format!("{}: {error}", file.display()))?;
        Ok(ObserverModel {
            observer: Box::new(observer),
            result: number.map_or(0, |number| number + 1),
            name: number.map_or_else(|| file.display().to_string(), |number| number.to_string()),
        })
    }
}
