//! Conversion to and from the frames of the `socketcan` crate, for programs that own one of its
//! sockets.

use socketcan::{CanAnyFrame, CanDataFrame, CanErrorFrame, CanFdFrame, CanRemoteFrame};
use socketcan::{EmbeddedFrame, ExtendedId, Frame as _, Id, StandardId, id::FdFlags};

use super::{Frame, FrameError, FrameId, FrameKind};

impl TryFrom<FrameId> for Id {
    type Error = FrameError;

    fn try_from(id: FrameId) -> Result<Self, FrameError> {
        match id {
            FrameId::Standard(raw) => StandardId::new(raw).map(Self::Standard),
            FrameId::Extended(raw) => ExtendedId::new(raw).map(Self::Extended),
        }
        .ok_or_else(|| id.out_of_range())
    }
}

impl FrameId {
    fn out_of_range(self) -> FrameError {
        let bits = if matches!(self, Self::Standard(_)) { 11 } else { 29 };
        FrameError::IdRange { id: self.number(), bits }
    }
}

impl From<Id> for FrameId {
    fn from(id: Id) -> Self {
        match id {
            Id::Standard(id) => Self::Standard(id.as_raw()),
            Id::Extended(id) => Self::Extended(id.as_raw()),
        }
    }
}

/// Converts a frame. The target type has no stamp, interface or direction, so they are dropped.
impl TryFrom<&Frame> for CanAnyFrame {
    type Error = FrameError;

    fn try_from(frame: &Frame) -> Result<Self, FrameError> {
        let (id, data, length) = (frame.id, frame.data(), usize::from(frame.length));
        let too_long = FrameError::ClassicLength { id, length };
        match frame.kind {
            FrameKind::Classic => {
                CanDataFrame::new(Id::try_from(id)?, data).map(Self::Normal).ok_or(too_long)
            }
            FrameKind::Remote => CanRemoteFrame::new_remote(Id::try_from(id)?, length)
                .map(Self::Remote)
                .ok_or(too_long),
            FrameKind::Error => {
                CanErrorFrame::new_error(id.number(), data).map(Self::Error).map_err(|_| too_long)
            }
            FrameKind::Fd { bit_rate_switch, error_state_indicator } => {
                let mut flags = FdFlags::empty();
                flags.set(FdFlags::BRS, bit_rate_switch);
                flags.set(FdFlags::ESI, error_state_indicator);
                CanFdFrame::with_flags(Id::try_from(id)?, data, flags)
                    .map(Self::Fd)
                    .ok_or(FrameError::FdLength { id, length })
            }
        }
    }
}

/// Converts a frame. The result has the interface 0 and the time 0.
impl TryFrom<&CanAnyFrame> for Frame {
    type Error = FrameError;

    fn try_from(frame: &CanAnyFrame) -> Result<Self, FrameError> {
        match frame {
            CanAnyFrame::Normal(frame) => Self::classic(frame.id().into(), frame.data()),
            CanAnyFrame::Remote(frame) => {
                let length = u8::try_from(frame.dlc()).unwrap_or(u8::MAX);
                Self::remote(frame.id().into(), length)
            }
            CanAnyFrame::Error(frame) => Self::error(frame.error_bits(), frame.data()),
            CanAnyFrame::Fd(frame) => Self::new(
                frame.hal_id().into(),
                FrameKind::Fd {
                    bit_rate_switch: frame.is_brs(),
                    error_state_indicator: frame.is_esi(),
                },
                frame.data(),
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_goes_there_and_back() {
        let (short, long) = (FrameId::Standard(0x123), FrameId::Extended(0x123));
        let fd = FrameKind::Fd { bit_rate_switch: true, error_state_indicator: true };
        let frames = [
            Frame::classic(short, &[1, 2, 3]),
            Frame::classic(long, &[]),
            Frame::remote(short, 4),
            Frame::fd(long, false, &[7; 64]),
            Frame::new(short, fd, &[7; 12]),
            Frame::error(0x44, &[0, 4, 0, 0, 0, 0, 0, 0]),
        ];
        for frame in frames.map(Result::unwrap) {
            let converted = CanAnyFrame::try_from(&frame).unwrap();
            assert_eq!(Frame::try_from(&converted), Ok(frame));
        }
    }

    #[test]
    fn a_frame_spoiled_by_hand_is_refused() {
        let good = Frame::classic(FrameId::Standard(1), &[1]).unwrap();
        for bad in [Frame { length: 9, ..good }, Frame { id: FrameId::Standard(0x800), ..good }] {
            assert!(CanAnyFrame::try_from(&bad).is_err());
        }
    }
}
