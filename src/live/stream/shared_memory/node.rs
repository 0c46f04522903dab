//! Membership of one thread in the cell's shared-memory network.

use std::path::Path;

use iceoryx2::node::Node;
use iceoryx2::prelude::{
    Config, FileName, LogLevel, NodeBuilder, Path as IpcPath, SemanticString, ServiceName,
    SignalHandlingMode, ipc, set_log_level,
};

use super::management::prepare;
use super::prefault::{SHARED_MEMORY, check_free, populate_mappings};
use crate::live::stream::options::MANAGEMENT_BYTES;
use crate::live::stream::{StreamError, StreamOptions};

/// Membership of a thread in the network. It creates ports, which must stay on the thread that
/// created them. Each thread therefore joins with its own node.
#[derive(Debug)]
pub struct StreamNode {
    pub(super) node: Node<ipc::Service>,
    options: StreamOptions,
}

impl StreamNode {
    /// Joins the network after checking that shared memory has space for the library's own needs.
    /// If the tmpfs were full, the library would leave a broken file in it. The space for a port is
    /// checked before the port is created.
    ///
    /// # Errors
    /// [`StreamError::Option`], [`StreamError::SharedMemoryFull`], [`StreamError::Foreign`],
    /// [`StreamError::Inspect`], [`StreamError::Node`].
    pub fn join(options: &StreamOptions) -> Result<Self, StreamError> {
        options.validate()?;
        // If two threads make their first call at the same time, both set the same level.
        set_log_level(LogLevel::Warn);
        check_free(Path::new(SHARED_MEMORY), MANAGEMENT_BYTES)?;
        prepare(Path::new(SHARED_MEMORY), &options.prefix)?;
        let refused = |cause: String| StreamError::Node { root: options.root.clone(), cause };
        let config = config(options).map_err(refused)?;
        let node = NodeBuilder::new()
            .config(&config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()
            .map_err(|cause| refused(format!("{cause:?}")))?;
        Ok(Self { node, options: options.clone() })
    }

    /// Returns the options of the node.
    pub fn options(&self) -> &StreamOptions {
        &self.options
    }

    /// Cleans up after dead processes of the cell, so that their ports can be created again.
    pub fn clean_up_dead(&self) {
        let cleaned = self.node.try_cleanup_dead_nodes();
        if cleaned.cleanups > 0 {
            tracing::warn!(processes = cleaned.cleanups, "cleaned up after processes that died");
        }
    }

    /// Checks that shared memory has space for a port with this payload size \[bytes\].
    pub(super) fn check_room(&self, bytes: u64) -> Result<(), StreamError> {
        check_free(Path::new(SHARED_MEMORY), bytes + MANAGEMENT_BYTES)
    }

    pub(super) fn prefault(&self) -> Result<(), StreamError> {
        populate_mappings(&self.options.prefix).map(|_| ())
    }

    /// Returns a service name in the library's form.
    pub(super) fn service(&self, topic: &str) -> Result<(String, ServiceName), StreamError> {
        let name = self.options.service_name(topic);
        let service =
            ServiceName::new(&name).map_err(|cause| StreamError::service(&name, cause))?;
        Ok((name, service))
    }
}

/// Creates the library's configuration from our options only. No configuration file is read.
fn config(options: &StreamOptions) -> Result<Config, String> {
    let mut config = Config::default();
    config.global.prefix =
        FileName::new(options.prefix.as_bytes()).map_err(|cause| format!("{cause:?}"))?;
    let root = options.root.to_str().ok_or("the root path is not UTF-8")?;
    let root = IpcPath::new(root.as_bytes()).map_err(|cause| format!("{cause:?}"))?;
    config.global.set_root_path(&root);
    Ok(config)
}
