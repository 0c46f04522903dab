//! The layout of a cell with the files that it names: a DBC file, the device files of its nodes, or
//! the description of its EtherCAT network.

use std::path::Path;

use didim_drivers::ethercat::Capture;
use didim_drivers::layout::{CompiledLayout, LayoutError, LayoutSpec};

use super::{CellError, Library};

/// Reads the files of the layout and compiles it. Also returns their texts, each with its name in
/// the stored copy.
pub(super) fn read(
    library: Library<'_>,
    cell: &Path,
    spec: &LayoutSpec,
) -> Result<(CompiledLayout, Vec<(String, String)>), CellError> {
    let folder = cell.parent().unwrap_or(Path::new(""));
    let named =
        |key| move |source| CellError::Named { cell: cell.into(), key, source: Box::new(source) };
    let refused =
        |with: &Path, source| CellError::Layout { file: cell.into(), with: with.into(), source };
    let (texts, with, compiled) = match (&spec.dbc, &spec.eni, &spec.startup) {
        (None, None, None) if spec.nodes.is_empty() => {
            return Err(CellError::Value {
                file: cell.into(),
                line: None,
                key: "bus.layout".to_owned(),
                problem: "names neither a `dbc` file, nor the device files of its `nodes`, nor an \
                    `eni` file or a `startup` of its `slaves`; give one of them"
                    .to_owned(),
            });
        }
        (Some(dbc), ..) => {
            let path = folder.join(dbc);
            let text = library.read_device_file(&path).map_err(named("bus.layout.dbc"))?;
            let compiled = CompiledLayout::compile(&text, spec);
            (vec![("bus.dbc".to_owned(), text)], path, compiled)
        }
        (None, Some(eni), _) => {
            let path = folder.join(eni);
            let text = library.read_device_file(&path).map_err(named("bus.layout.eni"))?;
            let compiled = CompiledLayout::compile_eni(&text, spec);
            (vec![("network.eni.xml".to_owned(), text)], path, compiled)
        }
        (None, None, Some(startup)) => {
            let path = folder.join(startup);
            let capture = Capture::open(&path).map_err(LayoutError::from);
            let compiled = capture.and_then(|open| CompiledLayout::compile_startup(open, spec));
            let text = compiled.as_ref().map(CompiledLayout::description).unwrap_or_default();
            // A capture is not text, so the network description that was read from it is stored
            // instead.
            (vec![("network.txt".to_owned(), text)], path, compiled)
        }
        (None, None, None) => {
            let files = spec.nodes.iter().filter_map(|node| node.file());
            let texts = files
                .map(|file| library.read_device_file(&folder.join(file)))
                .collect::<Result<Vec<_>, _>>()
                .map_err(named("bus.layout.nodes"))?;
            let borrowed: Vec<&str> = texts.iter().map(String::as_str).collect();
            let compiled = CompiledLayout::compile_nodes(&borrowed, spec);
            // A file that describes several nodes is stored once per node.
            let named = (1..).zip(texts).map(|(node, text)| (format!("node-{node}.eds"), text));
            (named.collect(), folder.to_path_buf(), compiled)
        }
    };
    let layout = compiled.map_err(|source| refused(&with, Box::new(source)))?;
    Ok((layout, texts))
}
