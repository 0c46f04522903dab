//! One thread's membership in the cell's shared-memory network.

use std::path::Path;

use iceoryx2::node::Node;
use iceoryx2::prelude::{
    Config, FileName, LogLevel, NodeBuilder, Path as IpcPath, SemanticString, ServiceName,
    SignalHandlingMode, ipc, set_log_level,
};

use super::options::MANAGEMENT_BYTES;
use super::prefault::{SHARED_MEMORY, check_free, populate};
use super::{StreamError, StreamOptions};

/// Membership in the network: makes the ports. Ports stay on the thread that made them, so each
/// thread joins with a node of its own.
#[derive(Debug)]
pub struct StreamNode {
    pub(super) node: Node<ipc::Service>,
    options: StreamOptions,
}

impl StreamNode {
    /// Joins, after checking that shared memory has room for the library's own needs: it leaves a
    /// broken file behind when it finds the tmpfs full. What a port needs is checked before it is
    /// made.
    ///
    /// # Errors
    /// [`StreamError::Option`], [`StreamError::SharedMemoryFull`], [`StreamError::Node`].
    pub fn join(options: &StreamOptions) -> Result<Self, StreamError> {
        options.validate()?;
        // Mutual first use by two threads is harmless: both set the same.
        set_log_level(LogLevel::Warn);
        check_free(Path::new(SHARED_MEMORY), MANAGEMENT_BYTES)?;
        let refused = |cause: String| StreamError::Node { root: options.root.clone(), cause };
        let config = config(options).map_err(refused)?;
        let node = NodeBuilder::new()
            .config(&config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<ipc::Service>()
            .map_err(|cause| refused(format!("{cause:?}")))?;
        Ok(Self { node, options: options.clone() })
    }

    /// The options it was made with.
    pub fn options(&self) -> &StreamOptions {
        &self.options
    }

    /// Cleans up after processes of the cell that died, so that their places are free again.
    pub fn clean_up_dead(&self) {
        let cleaned = self.node.try_cleanup_dead_nodes();
        if cleaned.cleanups > 0 {
            tracing::warn!(processes = cleaned.cleanups, "cleaned up after processes that died");
        }
    }

    /// Whether shared memory has room for a port with so much payload \[bytes\].
    pub(super) fn check_room(&self, bytes: u64) -> Result<(), StreamError> {
        check_free(Path::new(SHARED_MEMORY), bytes + MANAGEMENT_BYTES)
    }

    pub(super) fn prefault(&self) -> Result<(), StreamError> {
        populate(&self.options.prefix).map(|_| ())
    }

    /// The library's form of a service's name.
    pub(super) fn service(&self, topic: &str) -> Result<(String, ServiceName), StreamError> {
        let name = self.options.service_name(topic);
        let service =
            ServiceName::new(&name).map_err(|cause| StreamError::service(&name, cause))?;
        Ok((name, service))
    }
}

/// The library's configuration, from our options only: no file is looked for.
fn config(options: &StreamOptions) -> Result<Config, String> {
    let mut config = Config::default();
    config.global.prefix =
        FileName::new(options.prefix.as_bytes()).map_err(|cause| format!("{cause:?}"))?;
    let root = options.root.to_str().ok_or("the root path is not UTF-8")?;
    let root = IpcPath::new(root.as_bytes()).map_err(|cause| format!("{cause:?}"))?;
    config.global.set_root_path(&root);
    Ok(config)
}
