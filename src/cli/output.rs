//! Writing to stdout and to files that appear whole or not at all.

use std::io::Write;
use std::path::Path;

use didim_core::identification::Identification;

use super::CliError;
use crate::report::TorquePanel;
use crate::report::figure::torque_figure;

/// Writes to stdout. A reader that went away (`didim … | head`) is no failure.
pub(super) fn print(text: &str) -> Result<(), CliError> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(CliError::failed(error))
        }
        _ => Ok(()),
    }
}

/// Writes a file beside its place first, so that nothing half written is ever there.
pub(super) fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> Result<(), CliError>,
) -> Result<(), CliError> {
    let failed = |error: std::io::Error| {
        CliError::failed(std::io::Error::new(error.kind(), format!("{}: {error}", path.display())))
    };
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut file = tempfile::NamedTempFile::new_in(folder).map_err(failed)?;
    let mut buffered = std::io::BufWriter::new(&mut file);
    write(&mut buffered)?;
    buffered.flush().map_err(failed)?;
    drop(buffered);
    // The file is as readable as any other that the user makes, not private as temporary ones are.
    use std::os::unix::fs::PermissionsExt;
    file.as_file().set_permissions(std::fs::Permissions::from_mode(0o644)).map_err(failed)?;
    file.persist(path).map_err(|error| failed(error.error))?;
    Ok(())
}

/// One panel per joint of a fit.
pub(super) fn panels(identification: &Identification) -> Vec<TorquePanel<'_>> {
    let (estimate, fit) = (&identification.estimate, &identification.fit);
    fit.measured
        .iter()
        .zip(&fit.predicted)
        .zip(&estimate.relative_error_per_joint)
        .zip(1..)
        .map(|(((measured_nm, predicted_nm), relative_error), joint)| TorquePanel {
            joint,
            time_s: &fit.time_s,
            measured_nm,
            predicted_nm,
            relative_error: *relative_error,
        })
        .collect()
}

/// Writes the figure of measured against predicted torque.
pub(super) fn write_figure(path: &Path, identification: &Identification) -> Result<(), CliError> {
    let estimate = &identification.estimate;
    let heading =
        format!("{}: torque, measured and predicted by {}", estimate.robot, estimate.method);
    let svg = torque_figure(&heading, &panels(identification));
    write_whole(path, |out| out.write_all(svg.as_bytes()).map_err(CliError::failed))
}
