
// The ticks of the last seconds, a ring for each device. A row has the time and these numbers.
const COLUMNS = ["fx", "fy", "fz", "cx", "cy", "cz", "lateness", "execution", "age", "energy", "ledger", "pressure", "limits", "resync"];
const ROW = COLUMNS.length + 1;
// Of what a strip shows, with room for a block (s).
const KEPT_S = 4.2;

class Ring {
  constructor(room) {
    this.room = room;
    this.times = new Float64Array(room);
    this.columns = Object.fromEntries(COLUMNS.map((name) => [name, new Float32Array(room)]));
    this.count = 0; // ever pushed
    this.deadline = 0;
  }

  push(first, deadline, rows) {
    this.deadline = deadline;
    for (let at = 0; at + ROW <= rows.length; at += ROW) {
      const place = this.count % this.room;
      this.times[place] = first + rows[at] / 1000;
      COLUMNS.forEach((name, n) => { this.columns[name][place] = rows[at + 1 + n]; });
      this.count += 1;
    }
  }

  // Places in the ring whose time lies within, in order.
  *within(from, to) {
    for (let n = Math.max(0, this.count - this.room); n < this.count; n += 1) {
      const place = n % this.room;
      if (this.times[place] >= from && this.times[place] <= to) yield place;
    }
  }

  get newest() { return this.count > 0 ? (this.count - 1) % this.room : -1; }

  row(place) {
    return Object.fromEntries([["time", this.times[place]], ...COLUMNS.map((name) => [name, this.columns[name][place]])]);
  }

  newestTime() { return this.count > 0 ? this.times[this.newest] : 0; }
}

const rings = new Map();
function ring(device) {
  if (!rings.has(device)) rings.set(device, new Ring(Math.ceil(KEPT_S * (state.hello?.haptic_hz || 1000))));
  return rings.get(device);
}
