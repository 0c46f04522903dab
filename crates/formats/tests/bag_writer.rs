//! Bags of joint states as ROS 2 has them: `sensor_msgs/msg/JointState` in CDR, in MCAP by its
//! library.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// A joint state.
pub(crate) struct State<'a> {
    pub(crate) stamp_ns: u64,
    pub(crate) joints: &'a [&'a str],
    pub(crate) positions: &'a [f64],
    pub(crate) efforts: &'a [f64],
}

fn word(message: &mut Vec<u8>, word: u32) {
    message.resize(message.len().next_multiple_of(4), 0);
    message.extend(word.to_le_bytes());
}

fn length(message: &mut Vec<u8>, length: usize) {
    word(message, u32::try_from(length).unwrap());
}

fn text(message: &mut Vec<u8>, text: &str) {
    length(message, text.len() + 1);
    message.extend(text.bytes().chain([0]));
}

impl State<'_> {
    fn message(&self) -> Vec<u8> {
        let mut message = vec![0, 1, 0, 0];
        let [sec, nanosec] = [self.stamp_ns / 1_000_000_000, self.stamp_ns % 1_000_000_000];
        word(&mut message, u32::try_from(sec).unwrap());
        word(&mut message, u32::try_from(nanosec).unwrap());
        text(&mut message, "");
        length(&mut message, self.joints.len());
        self.joints.iter().for_each(|joint| text(&mut message, joint));
        for numbers in [self.positions, &[], self.efforts] {
            length(&mut message, numbers.len());
            for number in numbers {
                message.resize((message.len() - 4).next_multiple_of(8) + 4, 0);
                message.extend(number.to_le_bytes());
            }
        }
        message
    }
}

pub(crate) struct Bag {
    writer: mcap::Writer<BufWriter<File>>,
    /// By their topics.
    channels: BTreeMap<String, u16>,
    sequence: u32,
}

impl Bag {
    pub(crate) fn create(path: &Path) -> Self {
        let writer = mcap::Writer::new(BufWriter::new(File::create(path).unwrap())).unwrap();
        Self { writer, channels: BTreeMap::new(), sequence: 0 }
    }

    pub(crate) fn state(&mut self, topic: &str, state: &State<'_>) {
        self.write(topic, "sensor_msgs/msg/JointState", state.stamp_ns, &state.message());
    }

    /// The URDF, as robot_state_publisher latches it.
    #[allow(dead_code, reason = "not every test program describes its arm")]
    pub(crate) fn description(&mut self, urdf: &str) {
        let mut message = vec![0, 1, 0, 0];
        text(&mut message, urdf);
        self.write("/robot_description", "std_msgs/msg/String", 0, &message);
    }

    /// A frame of at most eight bytes, as ros2_socketcan publishes it.
    #[allow(dead_code, reason = "not every test program has frames")]
    pub(crate) fn can_frame(&mut self, topic: &str, stamp_ns: u64, id: u32, data: &[u8]) {
        let mut message = vec![0, 1, 0, 0];
        let [sec, nanosec] = [stamp_ns / 1_000_000_000, stamp_ns % 1_000_000_000];
        word(&mut message, u32::try_from(sec).unwrap());
        word(&mut message, u32::try_from(nanosec).unwrap());
        text(&mut message, "can");
        word(&mut message, id);
        message.extend([0, 0, 0, u8::try_from(data.len()).unwrap()]);
        message.extend(data);
        message.resize(message.len() + 8 - data.len(), 0);
        self.write(topic, "can_msgs/msg/Frame", stamp_ns, &message);
    }

    fn write(&mut self, topic: &str, kind: &str, log_time: u64, message: &[u8]) {
        let Self { writer, channels, sequence } = self;
        let channel_id = *channels.entry(topic.to_owned()).or_insert_with(|| {
            let schema = writer.add_schema(kind, "ros2msg", &[]).unwrap();
            writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap()
        });
        let header = mcap::records::MessageHeader {
            channel_id,
            sequence: *sequence,
            log_time,
            publish_time: log_time,
        };
        *sequence += 1;
        writer.write_to_known_channel(&header, message).unwrap();
    }

    pub(crate) fn finish(mut self) {
        self.writer.finish().unwrap();
    }
}
