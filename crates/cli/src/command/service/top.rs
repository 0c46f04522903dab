//! `didim top`: watches a running service.

mod screen;

use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};
use std::time::{Duration, Instant};

use clap::Args;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEventKind, KeyModifiers};
use ratatui::{DefaultTerminal, try_init, try_restore};

use super::status::WhichService;
use crate::CliError;
use crate::output::refuses_colour;
use didim::service::paths::Paths;
use didim::service::status::{ClientError, Snapshot, fetch_snapshot};
use didim::signals::stop_flag;
use screen::{View, draw};

/// Interval of the requests, equal to the interval of the service's status.
const REQUEST_INTERVAL: Duration = Duration::from_secs(1);
/// Longest delay until a key, a signal or a status is noticed.
const POLL_INTERVAL: Duration = Duration::from_millis(100);

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    #[command(flatten)]
    service: WhichService,
}

pub(super) fn execute(arguments: &Arguments) -> Result<(), CliError> {
    if !std::io::stdin().is_terminal() || !std::io::stdout().is_terminal() {
        return Err(CliError::Usage(
            "`didim top` needs a terminal; `didim status` prints the status once".to_owned(),
        ));
    }
    let paths = arguments.service.paths()?;
    let stop = stop_flag().map_err(CliError::from_failure)?;
    let answers = start_requests(paths).map_err(CliError::from_failure)?;
    // From here on, the guard restores the terminal at every exit: an error, a signal or a panic.
    let restored = TerminalGuard;
    let watched = try_init().and_then(|mut terminal| watch(&mut terminal, &answers, &stop));
    drop(restored);
    watched.map_err(CliError::from_failure)
}

/// Guard that restores the terminal.
struct TerminalGuard;

impl Drop for TerminalGuard {
    fn drop(&mut self) {
        if let Err(error) = try_restore() {
            tracing::debug!("cannot restore the terminal: {error}");
        }
    }
}

type Answer = Result<Snapshot, ClientError>;

/// Starts a thread that requests the status, because an answer may take seconds and keys must not
/// wait for it. The thread ends when the receiver is dropped.
fn start_requests(paths: Paths) -> std::io::Result<Receiver<Answer>> {
    let (answers, receiver) = sync_channel(1);
    std::thread::Builder::new().name("ask".into()).spawn(move || {
        let mut next = Instant::now();
        while answers.send(fetch_snapshot(&paths)).is_ok() {
            next = (next + REQUEST_INTERVAL).max(Instant::now());
            std::thread::sleep(next.saturating_duration_since(Instant::now()));
        }
    })?;
    Ok(receiver)
}

/// Returns true if the terminal has colours and `NO_COLOR` does not forbid them.
fn wants_colour() -> bool {
    let no_color = std::env::var_os("NO_COLOR");
    !refuses_colour(no_color.as_deref())
        && std::env::var_os("TERM").is_some_and(|term| term != "dumb")
}

fn watch(
    terminal: &mut DefaultTerminal,
    answers: &Receiver<Answer>,
    stop: &AtomicBool,
) -> std::io::Result<()> {
    let mut view = View { has_colour: wants_colour(), ..View::default() };
    let mut answered = Instant::now();
    let (mut scrolls, mut page) = (0, 1);
    let mut changed = true;
    while !stop.load(Ordering::Relaxed) {
        changed |= take_answer(answers, &mut view, &mut answered)?;
        if changed {
            terminal.draw(|frame| (scrolls, page) = draw(frame, &view))?;
            view.scrolled_lines = view.scrolled_lines.min(scrolls);
        }
        changed = false;
        if !event::poll(POLL_INTERVAL)? {
            continue;
        }
        match event::read()? {
            Event::Key(key) if key.kind != KeyEventKind::Release => {
                let control = key.modifiers.contains(KeyModifiers::CONTROL);
                match key.code {
                    KeyCode::Char('q') | KeyCode::Esc => return Ok(()),
                    KeyCode::Char('c') if control => return Ok(()),
                    KeyCode::Char('?' | 'h') => {
                        (view.shows_help, view.scrolled_lines) = (!view.shows_help, 0);
                    }
                    KeyCode::Char('s') => view.in_model_order = !view.in_model_order,
                    KeyCode::Char('p') => view.is_paused = !view.is_paused,
                    KeyCode::Up => view.scrolled_lines = view.scrolled_lines.saturating_sub(1),
                    KeyCode::Down => {
                        view.scrolled_lines = view.scrolled_lines.saturating_add(1).min(scrolls)
                    }
                    KeyCode::PageUp => {
                        view.scrolled_lines = view.scrolled_lines.saturating_sub(page)
                    }
                    KeyCode::PageDown => {
                        view.scrolled_lines = view.scrolled_lines.saturating_add(page).min(scrolls)
                    }
                    KeyCode::Home => view.scrolled_lines = 0,
                    KeyCode::End => view.scrolled_lines = scrolls,
                    _ => continue,
                }
                changed = true;
            }
            Event::Resize(..) => changed = true,
            _ => {}
        }
    }
    Ok(())
}

/// Takes an answer of the service, if there is one. Returns true if the screen has to be redrawn.
fn take_answer(
    answers: &Receiver<Answer>,
    view: &mut View,
    answered: &mut Instant,
) -> std::io::Result<bool> {
    match answers.try_recv() {
        Err(TryRecvError::Empty) => Ok(false),
        Err(TryRecvError::Disconnected) => {
            Err(std::io::Error::other("the thread that asks the service has ended"))
        }
        Ok(_) if view.is_paused => Ok(false),
        Ok(Ok(snapshot)) => {
            *answered = Instant::now();
            (view.snapshot, view.unreachable) = (Some(snapshot), None);
            Ok(true)
        }
        Ok(Err(error)) => {
            view.unreachable = Some((error.to_string(), answered.elapsed().as_secs()));
            Ok(true)
        }
    }
}
