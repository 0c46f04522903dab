//! JSON documents for other processes of the same user: estimates and status snapshots.

use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::port::update_connections::UpdateConnections as _;
use iceoryx2::prelude::{BackpressureStrategy, ipc};
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;

use super::node::StreamNode;
use crate::live::stream::options::MAX_DOCUMENT_BYTES;
use crate::live::stream::{StreamError, options};

/// Topics of the documents.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topic {
    /// Results as they are stored.
    Estimates,
    /// Status snapshot, published once a second.
    Status,
}

impl Topic {
    fn name(self) -> &'static str {
        match self {
            Self::Estimates => "estimates",
            Self::Status => "status",
        }
    }
}

type DocumentService = PortFactory<ipc::Service, [u8], ()>;

fn service(node: &StreamNode, topic: Topic) -> Result<(String, DocumentService), StreamError> {
    let (name, service) = node.service(topic.name())?;
    let service = node
        .node
        .service_builder(&service)
        .publish_subscribe::<[u8]>()
        // The acquisition and the estimation of a cell may be two processes, and each publishes its
        // own status.
        .max_publishers(2)
        .max_subscribers(options::MAX_DOCUMENT_READERS)
        .history_size(1)
        .subscriber_max_buffer_size(options::DOCUMENT_BUFFER)
        .subscriber_max_borrowed_samples(1)
        .enable_safe_overflow(true)
        .open_or_create()
        .map_err(|cause| StreamError::service(&name, cause))?;
    Ok((name, service))
}

impl StreamNode {
    /// Creates the writing end of a topic.
    ///
    /// # Errors
    /// The same as [`Self::sample_writer`].
    pub fn document_writer(&self, topic: Topic) -> Result<DocumentWriter, StreamError> {
        self.check_room(options::DOCUMENT_WRITER_BYTES)?;
        let writer = DocumentWriter::new(self, topic)?;
        self.prefault()?;
        Ok(writer)
    }

    /// Creates a reading end of a topic.
    ///
    /// # Errors
    /// The same as [`Self::sample_reader`].
    pub fn document_reader(&self, topic: Topic) -> Result<DocumentReader, StreamError> {
        DocumentReader::new(self, topic)
    }
}

/// The writing end of a topic. A late reader gets the last document at the next call of
/// [`DocumentWriter::publish`] or [`DocumentWriter::send_to_new_readers`].
#[derive(Debug)]
pub struct DocumentWriter {
    publisher: Publisher<ipc::Service, [u8], ()>,
    topic: Topic,
}

impl DocumentWriter {
    fn new(node: &StreamNode, topic: Topic) -> Result<Self, StreamError> {
        let (name, service) = service(node, topic)?;
        let publisher = service
            .publisher_builder()
            .initial_max_slice_len(MAX_DOCUMENT_BYTES)
            .max_loaned_samples(1)
            .backpressure_strategy(BackpressureStrategy::DiscardData)
            .create()
            .map_err(|cause| StreamError::port("publisher", &name, cause))?;
        Ok(Self { publisher, topic })
    }

    /// Publishes one document without waiting.
    ///
    /// # Errors
    /// [`StreamError::DocumentTooLong`], [`StreamError::Transport`].
    pub fn publish(&mut self, document: &[u8]) -> Result<(), StreamError> {
        if document.len() > MAX_DOCUMENT_BYTES {
            return Err(StreamError::DocumentTooLong {
                bytes: document.len(),
                limit: MAX_DOCUMENT_BYTES,
            });
        }
        let name = self.topic.name();
        let slot = self
            .publisher
            .loan_slice_uninit(document.len())
            .map_err(|cause| StreamError::transport("loaning", name, cause))?;
        slot.write_from_slice(document)
            .send()
            .map(|_| ())
            .map_err(|cause| StreamError::transport("sending", name, cause))
    }

    /// Sends the last document to readers that joined after it was published. Writers that publish
    /// rarely need this.
    ///
    /// # Errors
    /// [`StreamError::Transport`].
    pub fn send_to_new_readers(&mut self) -> Result<(), StreamError> {
        self.publisher
            .update_connections()
            .map_err(|cause| StreamError::transport("connecting", self.topic.name(), cause))
    }
}

/// A reading end of a topic.
#[derive(Debug)]
pub struct DocumentReader {
    subscriber: Subscriber<ipc::Service, [u8], ()>,
    topic: Topic,
}

impl DocumentReader {
    fn new(node: &StreamNode, topic: Topic) -> Result<Self, StreamError> {
        let (name, service) = service(node, topic)?;
        let subscriber = service
            .subscriber_builder()
            .create()
            .map_err(|cause| StreamError::port("subscriber", &name, cause))?;
        Ok(Self { subscriber, topic })
    }

    /// Returns the next waiting document. The first one may have been published before this reader
    /// joined.
    ///
    /// # Errors
    /// [`StreamError::Transport`].
    pub fn receive(&mut self) -> Result<Option<Vec<u8>>, StreamError> {
        let received = self
            .subscriber
            .receive()
            .map_err(|cause| StreamError::transport("receiving", self.topic.name(), cause))?;
        Ok(received.map(|sample| sample.payload().to_vec()))
    }
}
