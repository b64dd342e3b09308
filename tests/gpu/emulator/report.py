#!/usr/bin/env python3
"""Tables from a profile: report.py [--row NAME | --head | --json] PROFILE.tsv

PROFILE.tsv is what GPUEMU_PROFILE wrote. The times are a model, not a measurement: of a kernel the larger of what
memory, the second-level cache, issuing and the chain of one thread's instructions allow, and never less than a launch.
--row prints one line of numbers for a table, --head that table's head, --json the same numbers by name.
"""
import bisect
import json
import math
import sys

# Assumptions, all of them, to be replaced by what is measured on a device.
MEMORY, L2 = 4.8e12, 5.5e12       # bytes/s, H200; the second is what others have measured on H100
PCIE = 5e10                       # bytes/s between host and device
SMS, CLOCK, ISSUE = 132, 1.755e9, 4  # warp instructions a clock and SM
CHAIN = 5                         # clocks from an instruction to the next that needs it; ignores misses
MISS = 60                         # clocks a load costs a warp: 240 to the L2, four in flight; for `likely` alone
LAUNCH = 2.5e-6                   # s, of a kernel, copy or memset that a stream is given
GRAPH_NODE = 1.3e-6               # s, of the same in a graph, and of a conditional node's look at its value
GRAPH_LAUNCH = 6e-6               # s, of a graph, besides its nodes
READ = 8e-6                       # s, of a wait of the host
GRID_SYNC, OF_WAVE = 1.2e-6, 0.3e-6  # s, of a barrier of the whole grid, and more for each block on an SM

HEAD = ('scene', 'kernels by stream', 'by graph', 'graph launches', 'copies+memsets', 'host waits', 'grid syncs',
        'MB past L1', 'MB once', 'floor ms', 'likely ms', 'path ms')


def bounds(n, registers):
    """Seconds of one launch by what may limit it, and the likely time."""
    at_once = SMS * min(64, 65536 // (32 * max(1, registers)))  # warps
    deep = math.ceil(n['warps'] / at_once) / max(1, n['warps']) / CLOCK
    each = {'memory': 32 * (n['read_sectors'] + n['written_sectors']) / MEMORY, 'L2': 32 * n['block_sectors'] / L2,
            'issue': n['warp_instructions'] / (SMS * ISSUE * CLOCK), 'chain': n['warp_instructions'] * CHAIN * deep}
    syncs = n['grid_syncs'] * (GRID_SYNC + OF_WAVE * math.ceil(n['blocks'] / SMS))
    return each, syncs, (n['warp_instructions'] * CHAIN + n['requests'] * MISS) * deep


class Profile:
    def __init__(self, file):
        self.kernels, self.steps, self.events, self.sites = {}, [], [], []
        names = {}
        for line in open(file):
            kind, *values = line.rstrip('\n').split('\t')
            if kind[0] == '#':
                names[kind[1:]] = values
            elif kind == 'kernel':
                k = dict(zip(names[kind], values))
                self.kernels[k['name']] = {n: v if n == 'name' else int(v) for n, v in k.items()}
            elif kind == 'step':
                s = dict(zip(names[kind], values))
                self.steps.append({n: v if n in ('after', 'via', 'what', 'name') else int(v) for n, v in s.items()})
            elif kind == 'event':
                self.events.append((int(values[0]), int(values[1]), values[2], values[3]))
            elif kind == 'site':
                self.sites.append((int(values[0]), int(values[1]), int(values[2]), *values[3:]))
        for k in self.kernels.values():
            k.update(time=0, likely=0, each={'memory': 0, 'L2': 0, 'issue': 0, 'chain': 0, 'launch': 0, 'sync': 0})
        for s, before in zip(self.steps, [None, *self.steps]):
            self.cost(s, before)
        self.path('time'), self.path('likely')

    def cost(self, s, before):
        least = GRAPH_NODE if s['via'] == 'graph' else LAUNCH
        if s['what'] == 'kernel':
            k = self.kernels[s['name']]
            each, syncs, slow = bounds(s, k['registers'])
            s['time'] = max(least, max(each.values()) + syncs)
            s['likely'] = max(s['time'], slow + syncs)
            each.update(launch=least, sync=syncs)
            for bound, value in each.items():
                k['each'][bound] += value
            k['time'] += s['time']
            k['likely'] += s['likely']
        elif s['via'] == 'host':
            copy = before['time'] if before and before['what'] == 'copy device to host' else 0  # is a part of the wait
            s['time'] = 0 if 'Query' in s['what'] else max(0, READ - copy)
        elif s['what'] == 'graph launch':
            s['time'] = GRAPH_LAUNCH
        else:
            across = 'copy' in s['what'] and s['what'] != 'copy device to device'
            s['time'] = max(least, s['bytes'] / (PCIE if across else MEMORY))
        s.setdefault('likely', s['time'])

    def path(self, cost):
        """The longest chain of operations that must follow each other."""
        ends = {}  # by timeline: positions, when the operations there are over
        for s in self.steps:
            start = 0
            for timeline, position in [(s['timeline'], s['position'])] + [map(int, a.split(':')) for a in s['after'].split()]:
                positions, times = ends.get(timeline, ([], []))
                k = bisect.bisect_right(positions, position)
                start = max(start, times[k - 1] if k else 0)
            positions, times = ends.setdefault(s['timeline'], ([], []))
            positions.append(s['position'])
            times.append(start + s[cost])
        self.longest = getattr(self, 'longest', {})
        self.longest[cost] = max((times[-1] for _, times in ends.values()), default=0)

    def count(self, via, *what):
        return sum(s['via'] == via and s['what'] in what for s in self.steps)

    def numbers(self):
        moved = [w for w in {s['what'] for s in self.steps} if 'copy' in w or 'memset' in w]
        total = lambda name: sum(k[name] for k in self.kernels.values())
        return dict(zip(HEAD[1:], (
            self.count('stream', 'kernel'), self.count('graph', 'kernel'), self.count('stream', 'graph launch'),
            self.count('stream', *moved) + self.count('graph', *moved),
            sum(s['via'] == 'host' and 'Query' not in s['what'] for s in self.steps), total('grid_syncs'),
            32e-6 * total('block_sectors'), 32e-6 * (total('read_sectors') + total('written_sectors')),
            1e3 * sum(s['time'] for s in self.steps), 1e3 * sum(s['likely'] for s in self.steps), 1e3 * self.longest['time'])))


def show(value):
    return f'{value:.3f}' if isinstance(value, float) and value < 10 else f'{value:.0f}'


def tables(p):
    kernels, n = list(p.kernels.values()), p.numbers()
    print(f"{len(kernels)} kernels; " + ', '.join(f'{show(v)} {k}' for k, v in n.items() if not k.endswith(' ms')) +
          f", {p.count('graph', 'condition')} looks at conditions")
    print(f"{sum(k['instructions'] for k in kernels) / 1e6:.1f} M thread instructions, "
          f"{sum(k['loaded'] + k['stored'] for k in kernels) / 1e6:.1f} MB asked for, {sum(32 * k['sectors'] for k in kernels) / 1e6:.1f} MB in sectors, "
          f"{sum(k['local_bytes'] for k in kernels) / 1e6:.1f} MB stack")
    print(f"one after the other: floor {n['floor ms']:.3f} ms, likely {n['likely ms']:.3f} ms; along the longest path: "
          f"floor {n['path ms']:.3f} ms, likely {1e3 * p.longest['likely']:.3f} ms")
    alone = {b: sum(k['each'][b] for k in kernels) for b in (kernels[0]['each'] if kernels else ())}
    print('kernels by each bound alone: ' + ', '.join(f'{b} {1e3 * v:.3f}' for b, v in alone.items()) + ' ms\n')
    print(f"{'us':>8} {'likely':>8} {'bound':>6} {'launch':>6} {'syncs':>5} {'MB asked':>8} {'MB sect.':>8} {'coal.%':>6} {'MB L2':>7} {'MB mem':>7} "
          f"{'instr/thr':>9} {'active%':>7} {'MB stack':>8} {'regs':>4} {'frame':>5} {'spill':>5}  kernel")
    for k in sorted(kernels, key=lambda k: -k['likely'])[:45]:
        print(f"{1e6 * k['time']:8.1f} {1e6 * k['likely']:8.1f} {max(k['each'], key=k['each'].get):>6} {k['launches']:6} {k['grid_syncs']:5} "
              f"{(k['loaded'] + k['stored']) / 1e6:8.2f} {32 * k['sectors'] / 1e6:8.2f} {min(100, 100 * k['least_sectors'] / max(1, k['sectors'])):6.0f} "
              f"{32e-6 * k['block_sectors']:7.2f} {32e-6 * (k['read_sectors'] + k['written_sectors']):7.2f} {k['instructions'] / max(1, k['threads']):9.0f} "
              f"{100 * k['instructions'] / max(1, 32 * k['warp_instructions']):7.0f} {k['local_bytes'] / 1e6:8.2f} "
              f"{k['registers']:4} {k['stack']:5} {k['spilled']:5}  {k['name'][:110]}")
    print('\nwhat the host did')
    for times, size, what, after in sorted(p.events, reverse=True):
        print(f'{times:6} x {what}, {size} bytes, after {after[:100]}')
    print('\nthe accesses with most sectors')
    for requests, size, sectors, text, place, name in sorted(p.sites, key=lambda s: -s[2])[:25]:
        print(f"{32 * sectors / 1e6:8.2f} MB for {size / 1e6:.2f} asked ({sectors / requests:.1f} sectors a warp) {text}  {place}  in {name[:70]}")


def main():
    if sys.argv[1] == '--head':
        print('| ' + ' | '.join(HEAD) + ' |\n|' + ' --- |' * len(HEAD))
    elif sys.argv[1] == '--row':
        print('| ' + ' | '.join([sys.argv[2], *map(show, Profile(sys.argv[3]).numbers().values())]) + ' |')
    elif sys.argv[1] == '--json':
        print(json.dumps(Profile(sys.argv[2]).numbers()))
    else:
        tables(Profile(sys.argv[1]))


if __name__ == '__main__':
    main()
