//! What a run leaves behind, in columns: filled from the records of a run in memory, or from a log, without Python.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use palpate::Error;
use palpate::log::{Analysis, Environment, LogEntry, LogReader, LogRecord, RunReport, Topic, TopicKind};
use palpate::session::Summary;
use palpate_cli::columns::{self, Cell, Column, ColumnType};

/// What is added to a topic with contacts to name the table of the places that touch.
const POINTS: &str = "/points";

/// All topics of a run, and the run as a whole.
#[derive(Debug, Default)]
pub(crate) struct Recording {
    pub(crate) topics: BTreeMap<String, Columns>,
    pub(crate) report: RunReport,
    /// What is wrong with the log it was read from.
    pub(crate) damage: Option<String>,
    pub(crate) faults: Vec<String>,
    /// Cells of the entry at hand.
    cells: Vec<Cell>,
}

impl Recording {
    /// The records of a run that kept them.
    pub(crate) fn of_run(summary: Summary) -> Self {
        let mut recording = Self { faults: Self::faults_of(&summary), ..Self::default() };
        let environment = summary.report.environment.clone().unwrap_or_default();
        recording.declare(&environment);
        let mut names: HashMap<Topic, String> = HashMap::new();
        for record in summary.records {
            let topic = Topic::of(&record);
            let name = names.entry(topic).or_insert_with(|| topic.name(&environment));
            recording.push(&LogEntry::Record(record), topic.0, name);
        }
        Self { report: summary.report, ..recording }
    }

    /// What went wrong, a line each.
    pub(crate) fn faults_of(summary: &Summary) -> Vec<String> {
        let faults = summary.runtime.fault.iter().map(ToString::to_string);
        let log = summary.log_error.iter().map(|error| format!("the log is incomplete: {error}"));
        faults.chain(log).collect()
    }

    /// The log at `path`, to its end or to its first damage.
    ///
    /// # Errors
    /// If it cannot be read or is no log.
    pub(crate) fn read(path: &Path) -> Result<Self, Error> {
        let mut reader = LogReader::open(path)?;
        let (mut recording, mut analysis) = (Self::default(), Analysis::default());
        while let Some(Ok(entry)) = reader.next() {
            analysis.push_entry(&entry);
            if let LogEntry::Environment(environment) = &entry {
                recording.declare(environment);
            }
            if let Some(kind) = reader.kind(reader.topic()) {
                recording.push(&entry, kind, reader.topic());
            }
        }
        let damage = reader.damage().map(ToOwned::to_owned);
        Ok(Self { report: analysis.report(), damage, ..recording })
    }

    /// Makes the topics that every such run has, whether or not anything is in them.
    fn declare(&mut self, environment: &Environment) {
        // Known only once the run is over, or for viewers.
        let is_table = |kind| !matches!(kind, TopicKind::Stats | TopicKind::Log | TopicKind::Scene);
        for topic in Topic::declared(environment).filter(|topic| is_table(topic.0)) {
            self.topic(topic.0, &topic.name(environment));
        }
    }

    fn topic(&mut self, kind: TopicKind, name: &str) -> &mut Columns {
        if !self.topics.contains_key(name) {
            if kind == TopicKind::Contact {
                self.topics.insert(format!("{name}{POINTS}"), Columns::new(columns::POINT_COLUMNS, 0));
            }
            let (plain, turned) = (columns::columns(kind, false), columns::columns(kind, true));
            self.topics.insert(name.to_owned(), Columns::new(turned, turned.len() - plain.len()));
        }
        self.topics.get_mut(name).expect("it is there now")
    }

    fn push(&mut self, entry: &LogEntry, kind: TopicKind, name: &str) {
        let mut cells = std::mem::take(&mut self.cells);
        if let LogEntry::Record(LogRecord::ContactPoint(_)) = entry {
            columns::point_cells(entry, &mut cells);
            self.topic(kind, name);
            self.topic(kind, &format!("{name}{POINTS}")).push(&mut cells);
        } else {
            columns::cells(entry, true, &mut cells);
            let topic = self.topic(kind, name);
            topic.is_turned |= columns::is_turned(entry);
            topic.push(&mut cells);
        }
        self.cells = cells;
    }
}

/// A table in the making: columns of one type that stand side by side are one block, row by row, as numpy has it.
#[derive(Debug)]
pub(crate) struct Columns {
    columns: &'static [Column],
    /// How many of them only tools that turn have: the last ones.
    of_turned: usize,
    is_turned: bool,
    pub(crate) blocks: Vec<Block>,
    pub(crate) rows: usize,
}

/// Columns of one type, row by row; an optional number that is missing is -1.
#[derive(Debug)]
pub(crate) enum Block {
    F64(Vec<f64>, usize),
    F32(Vec<f32>, usize),
    U64(Vec<u64>, usize),
    U32(Vec<u32>, usize),
    I64(Vec<i64>, usize),
    /// Of each row the number of its word.
    Words(Vec<u32>, Words),
}

/// Each word once.
#[derive(Debug, Default)]
pub(crate) struct Words {
    pub(crate) words: Vec<String>,
    numbers: HashMap<String, u32>,
}

impl Words {
    fn number(&mut self, word: &str) -> u32 {
        if let Some(number) = self.numbers.get(word) {
            return *number;
        }
        let number = self.words.len() as u32;
        self.words.push(word.to_owned());
        self.numbers.insert(word.to_owned(), number);
        number
    }
}

impl Columns {
    fn new(columns: &'static [Column], of_turned: usize) -> Self {
        let mut blocks: Vec<Block> = Vec::new();
        for &(_, kind) in columns {
            match (blocks.last_mut(), kind) {
                (Some(Block::F64(_, width)), ColumnType::F64)
                | (Some(Block::F32(_, width)), ColumnType::F32)
                | (Some(Block::U64(_, width)), ColumnType::U64)
                | (Some(Block::U32(_, width)), ColumnType::U32)
                | (Some(Block::I64(_, width)), ColumnType::OptionalU32) => *width += 1,
                (_, ColumnType::F64) => blocks.push(Block::F64(Vec::new(), 1)),
                (_, ColumnType::F32) => blocks.push(Block::F32(Vec::new(), 1)),
                (_, ColumnType::U64) => blocks.push(Block::U64(Vec::new(), 1)),
                (_, ColumnType::U32) => blocks.push(Block::U32(Vec::new(), 1)),
                (_, ColumnType::OptionalU32) => blocks.push(Block::I64(Vec::new(), 1)),
                (_, ColumnType::Text) => blocks.push(Block::Words(Vec::new(), Words::default())),
            }
        }
        Self { columns, of_turned, is_turned: false, blocks, rows: 0 }
    }

    /// The columns that there are: those of tools that turn only if one has.
    pub(crate) fn columns(&self) -> &'static [Column] {
        let left_out = if self.is_turned { 0 } else { self.of_turned };
        &self.columns[..self.columns.len() - left_out]
    }

    /// Takes the cells of rows, one behind the other.
    fn push(&mut self, cells: &mut Vec<Cell>) {
        let mut left = cells.drain(..).peekable();
        while left.peek().is_some() {
            self.rows += 1;
            for block in &mut self.blocks {
                for _ in 0..block.width() {
                    block.push(&left.next().unwrap_or(Cell::Missing));
                }
            }
        }
    }
}

impl Block {
    pub(crate) fn width(&self) -> usize {
        match *self {
            Self::F64(_, width)
            | Self::F32(_, width)
            | Self::U64(_, width)
            | Self::U32(_, width)
            | Self::I64(_, width) => width,
            Self::Words(..) => 1,
        }
    }

    /// A cell of another type cannot be: columns and cells are declared side by side.
    fn push(&mut self, cell: &Cell) {
        match (self, cell) {
            (Self::F64(values, _), Cell::F64(value)) => values.push(*value),
            (Self::F32(values, _), Cell::F32(value)) => values.push(*value),
            (Self::U64(values, _), Cell::U64(value)) => values.push(*value),
            (Self::U32(values, _), Cell::U32(value)) => values.push(*value),
            (Self::I64(values, _), Cell::U32(value)) => values.push((*value).into()),
            (Self::I64(values, _), Cell::Missing) => values.push(-1),
            (Self::Words(numbers, words), Cell::Word(word)) => numbers.push(words.number(word)),
            (Self::Words(numbers, words), Cell::Text(word)) => numbers.push(words.number(word)),
            // What a tool that is not turned does not say.
            (Self::F64(values, _), _) => values.push(f64::NAN),
            (block, cell) => unreachable!("{cell:?} in {block:?}"),
        }
    }
}
