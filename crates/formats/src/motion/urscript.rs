//! A motion as a program for Universal Robots.

use core::fmt::Write as _;
use didim_dynamics::robot::JointIndex;

use didim_identification::excitation::FourierSeries;

use super::file::{MotionFile, identifier, list};
use super::spline::spline_coefficients;

/// The program evaluates a spline in each cycle of the controller. A list of all points would be
/// too large, and the Fourier series too slow. `servoj` ignores the speed slider, so the program
/// has its own speed.
const SERVO_LOOP: &str = "\
  movej(start, a = 0.5, v = 0.2)
  sleep(1.0)
  step = get_steptime()
  time = 0.0
  while time < duration:
    u = time / duration * knots
    i = floor(u)
    s = u - i
    s2 = s * s
    s3 = s2 * s
    s4 = s2 * s2
    s5 = s4 * s
    r = 1 - s
    r2 = r * r
    w = [r2 * r2 * r, 26 - 50 * s + 20 * s2 + 20 * s3 - 20 * s4 + 5 * s5, 66 - 60 * s2 + 30 * s4 - \
    10 * s5, \
26 + 50 * s + 20 * s2 - 20 * s3 - 20 * s4 + 10 * s5, 1 + 5 * s + 10 * s2 + 10 * s3 + 5 * s4 - 5 * \
    s5, s5]
    q = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    k = 0
    while k < 6:
      n = i + k - 2
      if n < 0:
        n = n + knots
      end
      if n >= knots:
        n = n - knots
      end
      share = w[k] / 120
      q[0] = q[0] + share * c1[n]
      q[1] = q[1] + share * c2[n]
      q[2] = q[2] + share * c3[n]
      q[3] = q[3] + share * c4[n]
      q[4] = q[4] + share * c5[n]
      q[5] = q[5] + share * c6[n]
      k = k + 1
    end
    servoj(q, 0, 0, step, 0.1, 300)
    time = time + step * speed
  end
  stopj(1.0)
end
";

pub(super) fn write(file: &MotionFile<'_>, series: &FourierSeries, name: &str) -> String {
    let name = identifier(name);
    let lists = spline_coefficients(series);
    let mut text = file.header_comments("#");
    let _ = writeln!(text, "def {name}():");
    text +=
        "  # Part of the speed of the motion: first 0.1, and 1.0 when it was seen to be free.\n";
    text += "  speed = 0.1\n";
    let _ = writeln!(text, "  duration = {:?}", file.motion.duration_s());
    let _ = writeln!(text, "  knots = {}", lists.first().map_or(0, Vec::len));
    let start = file.motion.state(0.0).position;
    let _ = writeln!(text, "  start = [{}]", list(start[..6].iter().copied(), 9));
    for (joint, own) in lists.into_iter().enumerate() {
        let _ = writeln!(text, "  c{} = [{}]", JointIndex::new(joint), list(own, 8));
    }
    text += SERVO_LOOP;
    let _ = writeln!(text, "{name}()");
    text
}
