#!/usr/bin/env python3
"""Translates one PTX module to C++, one file a kernel: translate.py MODULE.ptx OUT_DIR

OUT_DIR gets kernel_0.cpp, kernel_1.cpp, ... and an `index` that the runtime reads:
    variable NAME SPACE SIZE ALIGN HEX_BYTES|-
    kernel NUMBER NAME PLAIN|FIBERS ANY_ORDER|IN_ORDER MAX_THREADS SHARED_BYTES SIZE:ALIGN,...
What a PTX instruction means stands in ptx.h; here is only which one is meant, and of what types.
An instruction that is not known becomes a fault when (and if) it is executed, and is named on stderr.
"""
import re
import struct
import sys

SIZE = {'pred': 1, 'b8': 1, 'u8': 1, 's8': 1, 'b16': 2, 'u16': 2, 's16': 2, 'f16': 2, 'b32': 4,
        'u32': 4, 's32': 4, 'f32': 4, 'b64': 8, 'u64': 8, 's64': 8, 'f64': 8}
# The C++ type of a value of a PTX type.
CPP = {t: 'bool' if t == 'pred' else t if t[0] == 'f' else ('s' if t[0] == 's' else 'u') + t[1:]
       for t in SIZE}
OPERATOR = {'and': '&', 'or': '|', 'xor': '^'}
COMPARE = {'eq': '{a} == {b}', 'ne': '{a} != {b}', 'lt': '{a} < {b}', 'le': '{a} <= {b}',
           'gt': '{a} > {b}', 'ge': '{a} >= {b}', 'lo': '{a} < {b}', 'ls': '{a} <= {b}',
           'hi': '{a} > {b}', 'hs': '{a} >= {b}'}
COMPARE_FLOAT = {'ne': '({a} < {b} || {a} > {b})', 'equ': '!({a} < {b} || {a} > {b})',
                 'neu': '{a} != {b}', 'ltu': '!({a} >= {b})', 'leu': '!({a} > {b})',
                 'gtu': '!({a} <= {b})', 'geu': '!({a} < {b})',
                 'num': '({a} == {a} && {b} == {b})', 'nan': '({a} != {a} || {b} != {b})'}
ROUND = {'rz': 'FE_TOWARDZERO', 'rm': 'FE_DOWNWARD', 'rp': 'FE_UPWARD'}
TO_INTEGRAL = {'rni': 'nearest', 'rzi': 'chop', 'rmi': 'floor', 'rpi': 'ceil'}
SPECIAL = {'%laneid': 't.lane', '%warpid': 't.rank / 32', '%nwarpid': '64u', '%smid': '0u', '%nsmid': '132u',
           '%gridid': '0u', '%envreg1': 'u32(t.workspace >> 32)', '%envreg2': 'u32(t.workspace)', '%lanemask_eq': '(1u << t.lane)', '%lanemask_lt': '((1u << t.lane) - 1)',
           '%lanemask_le': '((2u << t.lane) - 1)', '%lanemask_gt': '~((2u << t.lane) - 1)',
           '%lanemask_ge': '~((1u << t.lane) - 1)', '%clock': 'u32(t.ticks += 1000)',
           '%clock64': '(t.ticks += 1000)', '%globaltimer': '(t.ticks += 1000)',
           '%dynamic_smem_size': 't.dynamic_shared', '%total_smem_size': 't.shared_size'}
for _name in ('tid', 'ntid', 'ctaid', 'nctaid'):
    for _k, _axis in enumerate('xyz'):
        SPECIAL[f'%{_name}.{_axis}'] = f't.{_name}[{_k}]'
VISIBLE = 'extern "C" [[gnu::visibility("default")]]'  # what the runtime looks up
# Kernels whose threads wait for each other, if only by looking again and again at what another one writes.
COLLECTIVE = re.compile(r'\b(bar|barrier|shfl|vote|match|redux|elect|nanosleep|atom)\.|\bcp\.async\b|\bld\.(volatile|relaxed|acquire|global\.c[gv])\b')
IN_ORDER = re.compile(r'\b(ld|st)\.(volatile|relaxed|acquire|release)\b|\batom\.[\w.:]*\b(inc|cas|exch)\b')


def identifier(name):
    """In C++; %f32 must not be the type f32."""
    return re.sub(r'\W', '_', name[1:]) + '_' if name[0] == '%' else 'v_' + re.sub(r'\W', '_', name)


class Unknown(Exception):
    """An instruction, or a form of one, that has no translation."""


class Scope(dict):
    """Names to what they are: ('reg', C++ type, C++ name, is it the function's), ('param', C++), ..."""

    def __init__(self, outer=None):
        super().__init__()
        self.outer = outer

    def find(self, name):
        scope = self
        while scope is not None:
            if name in scope:
                return scope[name]
            scope = scope.outer
        return None


def split_operands(text):
    """At commas outside brackets."""
    if '{' not in text and '(' not in text:
        return [part.strip() for part in text.split(',')] if text.strip() else []
    parts, depth, start = [], 0, 0
    for k, c in enumerate(text):
        if c in '{[(':
            depth += 1
        elif c in '}])':
            depth -= 1
        elif c == ',' and depth == 0:
            parts.append(text[start:k].strip())
            start = k + 1
    parts.append(text[start:].strip())
    return parts


class Function:
    """The C++ text of one .entry or .func."""
    STATEMENT = re.compile(r'\s*(?:(?P<open>\{)|(?P<close>\})|\.loc\s(?P<loc>[^\n]*)|'
                           r'(?P<label>[\w$.]+)\s*:(?!:)|(?P<text>[^;]*);)')

    def __init__(self, module, name, is_kernel, limits, returned, parameters, body):
        self.module, self.name, self.is_kernel, self.limits = module, name, is_kernel, limits
        self.scope = Scope(module.symbols)
        self.declared, self.out = [], []  # C++ lines: of arrays, of the rest
        self.registers = {}               # used ones: name to type, in C++
        self.shared_variables, self.sites, self.calls = [], [], []
        self.location, self.pending = '', 0  # of the next instruction; instructions not yet counted
        self.parameters, offset = [], 0
        for k, (pname, size, align) in enumerate(parameters):
            offset = -(-offset // align) * align
            self.scope[pname] = ('param', f't.params + {offset}' if is_kernel else f'p[{k}]')
            self.parameters.append((size, align))
            offset += size
        for pname, _, _ in returned:
            self.scope[pname] = ('param', 'ret')
        self.body(body)

    def body(self, text):
        at = 0
        while m := self.STATEMENT.match(text, at):
            at = m.end()
            kind = m.lastgroup
            if kind == 'text':
                self.statement(m.group('text').strip())
            elif kind == 'loc':
                self.located(m.group('loc'))
            elif kind == 'label':
                label = m.group('label')
                if text[at:].lstrip()[:14] == '.branchtargets':
                    m = self.STATEMENT.match(text, at)
                    at = m.end()
                    self.scope[label] = ('targets', [identifier(x) for x in split_operands(m.group('text').split(None, 1)[1])])
                    continue
                self.count()
                self.out.append(f'{identifier(label)}:;')
            elif kind == 'open':
                self.scope = Scope(self.scope)
                self.out.append('{')
            else:
                self.scope = self.scope.outer
                self.out.append('}')

    def located(self, text):
        numbers = re.findall(r'(\d+) (\d+) \d+', text)
        self.location = ' < '.join(f'{self.module.files.get(f, "?")}:{line}' for f, line in numbers)

    def site(self, text):
        self.sites.append((text, self.location))
        return f'first_site + {len(self.sites) - 1}'

    def count(self):
        if self.pending:
            self.out.append(f'COUNT({self.pending});')
        self.pending = 0

    # Declarations ------------------------------------------------------------------------------

    def declare(self, text):
        if text.startswith('.reg'):
            words = text.split(None, 2)
            kind = CPP[words[1][1:]]
            for name in words[2].split(','):
                m = re.match(r'([%\w$]+)(?:<(\d+)>)?', name.strip())
                names = [m.group(1)] if not m.group(2) else [f'{m.group(1)}{k}' for k in range(int(m.group(2)))]
                outermost = self.scope.outer is self.module.symbols
                for n in names:
                    self.scope[n] = ('reg', kind, identifier(n), outermost)
                if not outermost:
                    self.out.append(f'{kind} {", ".join(identifier(n) for n in names)};')
        elif text.startswith('.pragma'):
            pass
        else:
            name, size, align, space = variable(text)[:4]
            if space == 'local':
                self.scope[name] = ('local', identifier(name))
                self.declared.append(f'const Frame frame_{identifier(name)}(t, {size}, {align});'
                                     f' const u64 {identifier(name)} = frame_{identifier(name)}.begin;')
            elif space == 'shared':
                self.scope[name] = ('shared', f'shared_{identifier(name)}')
                self.shared_variables.append((name, size, align))
            elif space == 'param':
                self.scope[name] = ('param', identifier(name))
                self.out.append(f'alignas({max(align, 8)}) char {identifier(name)}[{size}];')
            else:
                raise Unknown(text)

    # Operands ----------------------------------------------------------------------------------

    def find(self, name):
        found = self.scope.find(name)
        if found is not None and found[0] == 'reg' and found[3]:
            self.registers[found[2]] = found[1]
        return found

    def read(self, operand, t):
        """A C++ expression of the type CPP[t]."""
        want = CPP[t]
        if operand[0] == '!':
            return f'!{self.read(operand[1:], t)}'
        if operand[0] == '-' and operand[1] == '%':
            return f'(-{self.read(operand[1:], t)})'
        if operand[0] in '-0123456789':
            return literal(operand, want)
        if operand in SPECIAL:
            return f'({want})({SPECIAL[operand]})'
        found = self.find(operand)
        if found is None:
            raise Unknown(f'operand {operand}')
        if found[0] != 'reg':
            return f'({want})({self.address_of(found)})'
        have, name = found[1], found[2]
        if have == want:
            return name
        if want[0] == 'f' or have[0] == 'f':
            return f'bits<{want}>({name})'
        return f'({want}){name}'

    def write(self, operand, t, expression):
        """Assigns an expression of the type CPP[t]."""
        if operand == '_':
            self.out.append(f'(void)({expression});')
            return
        found, have = self.find(operand), CPP[t]
        if found is None or found[0] != 'reg':
            raise Unknown(f'target {operand}')
        want, name = found[1], found[2]
        if want == have:
            self.out.append(f'{name} = {expression};')
        elif want[0] == 'f' or have[0] == 'f':
            self.out.append(f'{name} = bits<{want}>(({have})({expression}));')
        else:
            self.out.append(f'{name} = ({want})({have})({expression});')

    @staticmethod
    def address_of(found):
        kind, expression = found[0], found[1]
        return f'(u64)({expression})' if kind == 'param' else f'{expression}'

    def address(self, operand):
        """Of [register+8], [symbol+8] or [8]: what it starts from, and the whole as C++."""
        inside = operand.strip('[]').strip()
        m = re.match(r'([%\w$.]+)\s*(?:\+\s*(-?\w+))?$', inside)
        if not m:
            raise Unknown(f'address {operand}')
        base, offset = m.group(1), int(m.group(2), 0) if m.group(2) else 0
        found = ('immediate', base) if base[0].isdigit() else self.find(base)
        if found is None:
            raise Unknown(f'address {operand}')
        if found[0] == 'param':
            return found, f'{found[1]} + {offset}'
        start = found[2] if found[0] == 'reg' else found[1]
        start = f'(u64){start}'
        return found, start if offset == 0 else f'{start} + u64({offset})'

    # Instructions ------------------------------------------------------------------------------

    def statement(self, text):
        if text == '':
            return
        if text[0] == '.':
            self.declare(text)
            return
        self.pending += 1
        guard, full = '', text
        if text[0] == '@':
            guard, text = text[1:].split(None, 1)
        head, _, rest = text.partition(' ') if ' ' in text.split('\t')[0] else text.partition('\t')
        parts = head.strip().split('.')
        operands = split_operands(rest.strip())
        mark = len(self.out)
        if parts[0] in ('bra', 'ret', 'exit', 'call', 'brx', 'trap'):
            self.count()
            mark = len(self.out)
        try:
            getattr(self, 'do_' + parts[0], self.do_unknown)(parts, operands, full)
        except (Unknown, KeyError, IndexError, ValueError) as problem:
            print(f'{self.name}: not translated: {full!r} ({problem})', file=sys.stderr)
            del self.out[mark:]
            self.out.append(f'fault_unknown(t, {self.site(full)});')
        if guard:
            self.out[mark:] = [f'if ({self.read(guard, "pred")}) {{', *self.out[mark:], '}']

    def do_unknown(self, parts, operands, full):
        raise Unknown(parts[0])

    def result(self, parts, operands, t, expression):
        """Writes with the modifiers .sat and .ftz that floats may have."""
        if t[0] == 'f':
            if 'ftz' in parts:
                expression = f'ftz({expression})'
            if 'sat' in parts:
                expression = f'saturate({expression})'
        self.write(operands[0], t, expression)

    def reads(self, parts, operands, t):
        values = [self.read(o, t) for o in operands]
        return [f'ftz({v})' for v in values] if 'ftz' in parts and t[0] == 'f' else values

    def arithmetic(self, parts, operands, function, plain):
        """plain: the expression when rounded to nearest; function: its name for other roundings."""
        t = parts[-1]
        values = self.reads(parts, operands[1:], t)
        rounding = next((ROUND[p] for p in parts if p in ROUND), None)
        if rounding and t[0] == 'f':
            expression = f'rounded_{function}({rounding}, {", ".join(values)})'
        else:
            expression = plain.format(*values)
        self.result(parts, operands, t, expression)

    def do_add(self, parts, operands, full):
        if 'cc' in parts:
            raise Unknown('carry')
        if 'sat' in parts and parts[-1] == 's32':
            raise Unknown('saturating integers')
        self.arithmetic(parts, operands, 'add', '{} + {}')

    def do_sub(self, parts, operands, full):
        if 'cc' in parts or ('sat' in parts and parts[-1] == 's32'):
            raise Unknown('carry or saturation')
        self.arithmetic(parts, operands, 'sub', '{} - {}')

    def do_mul(self, parts, operands, full):
        t = parts[-1]
        if t[0] == 'f':
            return self.arithmetic(parts, operands, 'mul', '{} * {}')
        a, b = self.read(operands[1], t), self.read(operands[2], t)
        if 'wide' in parts:
            wide = t[0] + str(8 * SIZE[t] * 2)
            return self.write(operands[0], wide, f'({CPP[wide]}){a} * ({CPP[wide]}){b}')
        self.write(operands[0], t, f'high_product<{CPP[t]}>({a}, {b})' if 'hi' in parts else
                   f'({CPP[t]})({a} * {b})' if SIZE[t] > 2 else f'(u32){a} * (u32){b}')

    def do_mad(self, parts, operands, full):
        t = parts[-1]
        if 'cc' in parts or 'sat' in parts:
            raise Unknown('carry or saturation')
        if t[0] == 'f':
            return self.do_fma(parts, operands, full)
        a, b = self.read(operands[1], t), self.read(operands[2], t)
        if 'wide' in parts:
            wide = t[0] + str(8 * SIZE[t] * 2)
            c = self.read(operands[3], wide)
            return self.write(operands[0], wide, f'({CPP[wide]}){a} * ({CPP[wide]}){b} + {c}')
        product = f'high_product<{CPP[t]}>({a}, {b})' if 'hi' in parts else f'{a} * {b}'
        self.write(operands[0], t, f'{product} + {self.read(operands[3], t)}')

    def do_fma(self, parts, operands, full):
        self.arithmetic(parts, operands, 'fma', 'fused({}, {}, {})')

    def do_div(self, parts, operands, full):
        if parts[-1][0] == 'f':
            return self.arithmetic(parts, operands, 'div', '{} / {}')
        self.arithmetic(parts, operands, '', 'quotient({}, {})')

    def do_rem(self, parts, operands, full):
        self.arithmetic(parts, operands, '', 'remainder_of({}, {})')

    def do_sqrt(self, parts, operands, full):
        self.arithmetic(parts, operands, 'sqrt', 'std::sqrt({})')

    def do_rcp(self, parts, operands, full):
        self.arithmetic(parts, operands, 'rcp', '1 / {}')

    def do_min(self, parts, operands, full):
        nan = '_nan' if 'NaN' in parts else ''
        self.arithmetic([p for p in parts if p != 'NaN'], operands, '', f'smaller{nan}({{}}, {{}})')

    def do_max(self, parts, operands, full):
        nan = '_nan' if 'NaN' in parts else ''
        self.arithmetic([p for p in parts if p != 'NaN'], operands, '', f'larger{nan}({{}}, {{}})')

    def unary(name):
        def do(self, parts, operands, full):
            self.arithmetic(parts, operands, '', f'{name}({{}})')
        return do

    # The approximations of the hardware are the exact functions, rounded once.
    do_ex2, do_lg2, do_rsqrt = unary('exp2_of'), unary('log2_of'), unary('rsqrt_of')
    do_sin, do_cos, do_tanh = unary('sin_of'), unary('cos_of'), unary('tanh_of')
    do_abs, do_neg = unary('absolute'), unary('-')

    def do_not(self, parts, operands, full):
        t = parts[-1]
        self.write(operands[0], t, f'{"!" if t == "pred" else "~"}{self.read(operands[1], t)}')

    def do_and(self, parts, operands, full):
        t = parts[-1]
        a, b = self.read(operands[1], t), self.read(operands[2], t)
        self.write(operands[0], t, f'{a} {OPERATOR[parts[0]]} {b}')

    do_or = do_xor = do_and

    def do_shl(self, parts, operands, full):
        t = parts[-1]
        name = 'shifted_left' if parts[0] == 'shl' else 'shifted_right'
        self.write(operands[0], t, f'{name}({self.read(operands[1], t)}, {self.read(operands[2], "u32")})')

    do_shr = do_shl

    def do_shf(self, parts, operands, full):
        a, b, c = (self.read(o, 'u32') for o in operands[1:])
        self.write(operands[0], 'u32', f'funnel_{parts[1]}_{parts[2]}({a}, {b}, {c})')

    def do_popc(self, parts, operands, full):
        self.write(operands[0], 'u32', f'std::popcount({self.read(operands[1], "u" + parts[-1][1:])})')

    def do_clz(self, parts, operands, full):
        self.write(operands[0], 'u32', f'std::countl_zero({self.read(operands[1], "u" + parts[-1][1:])})')

    def do_brev(self, parts, operands, full):
        t = 'u' + parts[-1][1:]
        self.write(operands[0], t, f'reversed_bits({self.read(operands[1], t)})')

    def do_bfe(self, parts, operands, full):
        t = parts[-1]
        self.write(operands[0], t, f'extracted({self.read(operands[1], t)}, {self.read(operands[2], "u32")}, {self.read(operands[3], "u32")})')

    def do_bfi(self, parts, operands, full):
        t = 'u' + parts[-1][1:]
        a, b = self.read(operands[1], t), self.read(operands[2], t)
        self.write(operands[0], t, f'inserted({a}, {b}, {self.read(operands[3], "u32")}, {self.read(operands[4], "u32")})')

    def do_bmsk(self, parts, operands, full):
        self.write(operands[0], 'u32', f'bit_mask({self.read(operands[1], "u32")}, {self.read(operands[2], "u32")})')

    def do_bfind(self, parts, operands, full):
        self.write(operands[0], 'u32', f'highest_bit({self.read(operands[1], parts[-1])}, {int("shiftamt" in parts)})')

    def do_prmt(self, parts, operands, full):
        if len(parts) > 2:
            raise Unknown('mode of prmt')
        self.write(operands[0], 'u32', f'permuted({", ".join(self.read(o, "u32") for o in operands[1:])})')

    def do_lop3(self, parts, operands, full):
        self.write(operands[0], 'u32', f'lop3<{operands[4]}>({", ".join(self.read(o, "u32") for o in operands[1:4])})')

    def do_copysign(self, parts, operands, full):
        t = parts[-1]
        self.write(operands[0], t, f'std::copysign({self.read(operands[2], t)}, {self.read(operands[1], t)})')

    def do_testp(self, parts, operands, full):
        self.write(operands[0], 'pred', f'testp_{parts[1]}({self.read(operands[1], parts[-1])})')

    def do_setp(self, parts, operands, full):
        t = parts[-1]
        a, b = self.reads(parts, operands[1:3], t)
        table = COMPARE_FLOAT if t[0] == 'f' else {}
        expression = (table.get(parts[1]) or COMPARE[parts[1]]).format(a=a, b=b)
        also = next((p for p in parts[2:] if p in OPERATOR), None)
        targets = operands[0].split('|')
        if len(targets) == 1 and not also:
            return self.write(targets[0], 'pred', expression)
        self.out.append(f'{{ const bool outcome = {expression};')
        c = f' {OPERATOR[also]} {self.read(operands[3], "pred")}' if also else ''
        values = [f'outcome{c}', f'!outcome{c}']
        self.out.append('const bool value[2] = {%s};' % ', '.join(f'bool({v})' for v in values))
        for k, target in enumerate(targets):
            self.write(target.strip(), 'pred', f'value[{k}]')
        self.out.append('}')

    def do_selp(self, parts, operands, full):
        t = parts[-1]
        a, b, p = self.read(operands[1], t), self.read(operands[2], t), self.read(operands[3], 'pred')
        self.write(operands[0], t, f'{p} ? {a} : {b}')

    def do_slct(self, parts, operands, full):
        t = parts[-2]
        a, b, c = self.read(operands[1], t), self.read(operands[2], t), self.read(operands[3], parts[-1])
        self.write(operands[0], t, f'{c} >= 0 ? {a} : {b}')

    def do_mov(self, parts, operands, full):
        t = parts[-1]
        target, source = operands
        if target[0] == '{' or source[0] == '{':
            pieces = split_operands((target if target[0] == '{' else source).strip('{} '))
            piece = f'b{8 * SIZE[t] // len(pieces)}'
            if source[0] == '{':
                shifted = [f'(u{t[1:]}){self.read(s, piece)} << {8 * SIZE[piece] * k}' for k, s in enumerate(pieces)]
                return self.write(target, 'b' + t[1:], ' | '.join(shifted))
            self.out.append(f'{{ const u{t[1:]} whole = {self.read(source, "b" + t[1:])};')
            for k, p in enumerate(pieces):
                self.write(p, piece, f'({CPP[piece]})(whole >> {8 * SIZE[piece] * k})')
            return self.out.append('}')
        self.write(target, t, self.read(source, t))

    def do_cvt(self, parts, operands, full):
        to, of = parts[-2], parts[-1]
        if 'f16' in (to, of) or to not in SIZE or of not in SIZE or len(operands) != 2:
            raise Unknown('conversion')
        a = self.read(operands[1], of)
        if 'ftz' in parts and of == 'f32':
            a = f'ftz({a})'
        integral = next((TO_INTEGRAL[p] for p in parts if p in TO_INTEGRAL), None)
        if integral:
            a = f'integral_{integral}({a})'
        directed = next((ROUND[p] for p in parts if p in ROUND), None)
        if to[0] == 'f':
            expression = f'rounded_to<{CPP[to]}>({directed}, {a})' if directed else f'({CPP[to]}){a}'
            return self.result(parts, operands, to, expression)
        if of[0] == 'f':
            return self.write(operands[0], to, f'to_integer<{CPP[to]}>({a})')
        self.write(operands[0], to, f'saturated_to<{CPP[to]}>({a})' if 'sat' in parts else f'({CPP[to]}){a}')

    def do_cvta(self, parts, operands, full):
        """Shared memory alone has addresses of its own; all others are generic ones."""
        a = self.read(operands[1], 'u64')
        if 'shared' in parts:
            a += ' - shared_window' if 'to' in parts else ' + shared_window'
        self.write(operands[0], 'u64', a)

    def do_isspacep(self, parts, operands, full):
        self.write(operands[0], 'pred', f'is_{parts[1]}(t, {self.read(operands[1], "u64")})')

    # Memory ------------------------------------------------------------------------------------

    @staticmethod
    def space(parts):
        return next((p.split('::')[0] for p in parts if p.split('::')[0] in ('global', 'shared', 'local', 'const')), 'generic')

    @staticmethod
    def order(parts):
        """What an access promises about others."""
        if 'cta' in parts or 'cluster' in parts:
            return 0
        return int('acquire' in parts or 'acq_rel' in parts) + 2 * int('release' in parts or 'acq_rel' in parts)

    @staticmethod
    def window(space):
        return 'shared_window + ' if space == 'shared' else ''

    def do_ld(self, parts, operands, full):
        t = parts[-1]
        names = split_operands(operands[0].strip('{} '))
        base, address = self.address(operands[1])
        if 'param' in parts and base[0] == 'param':
            for k, name in enumerate(names):
                self.write(name, t, f'at_byte<{CPP[t]}>({address} + {k * SIZE[t]})')
            return
        space = 'parameter' if 'param' in parts else self.space(parts)
        strong = any(p in ('volatile', 'relaxed', 'acquire', 'mmio') for p in parts)
        looks = strong or 'cg' in parts or 'cv' in parts  # what a loop may wait for
        if looks:
            site = self.site(full)
            self.out.append(f'{{ const u64 where = {address};')
            address = 'where'
        use = 'strong_load' if strong else 'constant_load' if 'nc' in parts else 'load'
        source = f'at<{space}_space, {use}, {CPP[t]}, {len(names)}>(t, {site if looks else self.site(full)}, {address})'
        if len(names) == 1:
            self.write(names[0], t, f'*{source}')
        else:
            self.out.append(f'{{ const {CPP[t]}* from = {source};')
            for k, name in enumerate(names):
                self.write(name, t, f'from[{k}]')
            self.out.append('}')
        if looks:
            self.out.append(f'strong_access(t, {site}, {self.window(space)}where, {4 + self.order(parts)}, true, false); }}')

    do_ldu = do_ld

    def do_st(self, parts, operands, full):
        t = parts[-1]
        values = [self.read(v, t) for v in split_operands(operands[1].strip('{} '))]
        base, address = self.address(operands[0])
        if 'param' in parts:
            for k, value in enumerate(values):
                self.out.append(f'at_byte<{CPP[t]}>({address} + {k * SIZE[t]}) = {value};')
            return
        strong = any(p in ('volatile', 'relaxed', 'release', 'mmio') for p in parts)
        site, space = self.site(full), self.space(parts)
        self.out.append(f'store<{space}_space, {"strong_store" if strong else "store_"}, {CPP[t]}>'
                        f'(t, {site}, {address}, {", ".join(values)});')
        if strong:
            self.out.append(f'strong_access(t, {site}, {self.window(space)}({address}), {self.order(parts)}, false, true);')

    def do_atom(self, parts, operands, full):
        t = parts[-1]
        operation = next(p for p in parts[1:] if p in ('add', 'min', 'max', 'inc', 'dec', 'cas', 'exch', 'and', 'or', 'xor'))
        if parts[0] == 'red':
            operands = ['_', *operands]
        if 'L2::cache_hint' in parts:
            operands.pop()
        _, address = self.address(operands[1])
        values = ', '.join(self.read(v, t) for v in operands[2:])
        self.write(operands[0], t, f'atomic<{self.space(parts)}_space, {CPP[t]}, {self.order(parts)}, {str(operands[0] != "_").lower()}>'
                   f'(t, {self.site(full)}, {address}, '
                   f'[&]({CPP[t]} old) {{ return atomic_{operation}<{CPP[t]}>(old, {values}); }})')

    do_red = do_atom

    def do_nothing(self, parts, operands, full):
        pass

    do_prefetch = do_prefetchu = do_griddepcontrol = do_createpolicy = do_discard = do_nothing

    def do_fence(self, parts, operands, full):
        if 'proxy' in parts or 'mbarrier_init' in parts:
            raise Unknown('fence of another kind')
        if not any(p in ('cta', 'cluster') for p in parts):
            self.out.append('fence(t);')

    do_membar = do_fence

    def do_cp(self, parts, operands, full):
        if parts[1] != 'async' or 'bulk' in parts or 'mbarrier' in parts:
            raise Unknown('copy by another unit')
        if 'commit_group' in parts:
            return self.out.append('++t.copy_group;')
        if 'wait_group' in parts or 'wait_all' in parts:
            return self.out.append(f'wait_copies(t, {self.read(operands[0], "u32") if operands else "~0u"});')
        (_, to), (_, source), given = self.address(operands[0]), self.address(operands[1]), operands[min(3, len(operands) - 1)]
        if '%p' in given:
            raise Unknown('ignored source')
        self.out.append(f'copy_async<{operands[2]}>(t, {self.site(full)}, {to}, {source}, {self.read(given, "u32")});')

    # Control -----------------------------------------------------------------------------------

    def do_bra(self, parts, operands, full):
        self.out.append(f'goto {identifier(operands[0])};')

    def do_brx(self, parts, operands, full):
        targets = self.find(operands[1])[1]
        cases = ' '.join(f'case {k}: goto {label};' for k, label in enumerate(targets))
        self.out.append(f'switch ({self.read(operands[0], "u32")}) {{ {cases} default: __builtin_unreachable(); }}')

    def do_ret(self, parts, operands, full):
        self.out.append('return;')

    def do_exit(self, parts, operands, full):
        self.out.append('return;' if self.is_kernel else 'throw ThreadExit{};')

    def do_trap(self, parts, operands, full):
        self.out.append(f'fault_trap(t, {self.site(full)});')

    def do_call(self, parts, operands, full):
        returned = operands.pop(0).strip('() ') if operands[0][0] == '(' else ''
        name = operands[0]
        given = split_operands(operands[1].strip('() \n\t')) if len(operands) > 1 else []
        if name not in self.module.functions:
            if name == '__assertfail':
                return self.out.append(f'fault_trap(t, {self.site("assertion")});')
            if name == 'cudaGraphSetConditional':
                handle, value = (self.find(g)[1] for g in given)
                return self.out.append(f'set_conditional(t, {self.site(name)}, at_byte<u64>({handle}), at_byte<u32>({value}));')
            raise Unknown(f'call of {name}')
        self.calls.append(name)
        pointers = ', '.join(self.find(g)[1] for g in given) or 'nullptr'
        result = self.find(returned)[1] if returned else 'nullptr'
        self.out.append(f'{{ char* given[] = {{{pointers}}}; {identifier(name)}(t, {result}, given); }}')

    def do_bar(self, parts, operands, full):
        site = self.site(full)
        if 'warp' in parts:
            return self.out.append(f'warp_barrier(t, {site}, {self.read(operands[0], "u32")});')
        if 'arrive' in parts:
            raise Unknown('arrive')
        if 'red' in parts:
            operation = next(p for p in parts if p in ('popc', 'and', 'or'))
            count = self.read(operands[2], 'u32') if len(operands) > 3 else '0u'
            value = self.read(operands[-1], 'pred')
            t = 'u32' if operation == 'popc' else 'pred'
            field = {'popc': 'popc', 'and': 'all', 'or': 'any'}[operation]
            return self.write(operands[0], t, f'block_barrier(t, {site}, {self.read(operands[1], "u32")}, {count}, {value}).{field}')
        count = self.read(operands[1], 'u32') if len(operands) > 1 else '0u'
        number = self.read(operands[0], 'u32') if operands else '0u'
        self.out.append(f'block_barrier(t, {site}, {number}, {count}, false);')

    do_barrier = do_bar

    def do_shfl(self, parts, operands, full):
        mode = next(p for p in parts if p in ('up', 'down', 'bfly', 'idx'))
        target, _, valid = operands[0].partition('|')
        a, b, c, mask = (self.read(o, 'u32') for o in operands[1:5])
        self.out.append(f'{{ const Shuffled got = shuffle_{mode}(t, {self.site(full)}, {a}, {b}, {c}, {mask});')
        self.write(target.strip(), 'u32', 'got.value')
        if valid:
            self.write(valid.strip(), 'pred', 'got.valid')
        self.out.append('}')

    def do_vote(self, parts, operands, full):
        mode = next(p for p in parts if p in ('ballot', 'any', 'all', 'uni'))
        self.write(operands[0], 'u32' if mode == 'ballot' else 'pred',
                   f'vote_{mode}(t, {self.site(full)}, {self.read(operands[1], "pred")}, {self.read(operands[2], "u32")})')

    def do_match(self, parts, operands, full):
        if 'any' not in parts:
            raise Unknown('match.all')
        self.write(operands[0], 'u32', f'match_any(t, {self.site(full)}, {self.read(operands[1], "u" + parts[-1][1:])}, {self.read(operands[2], "u32")})')

    def do_redux(self, parts, operands, full):
        operation = next(p for p in parts if p in ('add', 'min', 'max', 'and', 'or', 'xor'))
        t = parts[-1]
        self.write(operands[0], t, f'reduce_warp<{CPP[t]}>(t, {self.site(full)}, {self.read(operands[1], t)}, {self.read(operands[2], "u32")}, '
                   f'[]({CPP[t]} a, {CPP[t]} b) {{ return atomic_{operation}<{CPP[t]}>(a, b); }})')

    def do_activemask(self, parts, operands, full):
        """Which threads are together is up to the hardware; a thread alone is always allowed."""
        self.write(operands[0], 'u32', '1u << t.lane')

    def do_nanosleep(self, parts, operands, full):
        self.out.append(f'give_way(t, {self.site(full)});')

    def text(self):
        head = (f'{VISIBLE} void kernel(Thread& t) {{' if self.is_kernel else
                f'static void {identifier(self.name)}(Thread& t, char* ret, char* const* p) {{')
        registers = {}
        for name, kind in self.registers.items():
            registers.setdefault(kind, []).append(f'{name} = 0')
        declared = [f'{kind} {", ".join(names)};' for kind, names in registers.items()]
        return '\n'.join([head, *declared, *self.declared, *self.out, '}'])


def literal(text, want):
    """The C++ of a PTX number."""
    if text[:2] in ('0f', '0F', '0d', '0D'):
        double = text[1] in 'dD'
        value = struct.unpack('>d' if double else '>f', bytes.fromhex(text[2:]))[0]
        if value == value and abs(value) != float('inf'):
            plain = value.hex() + ('' if double else 'f')
        else:
            plain = f'bits<{"f64" if double else "f32"}>(0x{text[2:]}{"ull" if double else "u"})'
        have = 'f64' if double else 'f32'
        return f'({plain})' if want == have else f'bits<{want}>({plain})' if want[0] != 'f' else f'({want})({plain})'
    number = int(text.rstrip('Uu'), 0) & (1 << 64) - 1
    return f'({want}){number}ull' if want != 'bool' else ('true' if number else 'false')


def variable(text):
    """Name, bytes, alignment, space and initial bytes of a declaration."""
    m = re.match(r'(?:\.(?:visible|extern|weak|hidden|common)\s+)*\.(global|const|shared|local|param)\s+(?:\.attribute\([^)]*\)\s*)?'
                 r'(?:\.align\s+(\d+)\s+)?\.(\w+)\s+([\w%$.]+)\s*((?:\[\d*\])*)\s*(?:=\s*(.*))?$', text, re.S)
    if not m:
        raise Unknown(text)
    space, align, kind, name, dimensions, start = m.groups()
    size = SIZE[kind]
    for d in re.findall(r'\[(\d*)\]', dimensions):
        size *= int(d or 0)
    data = None
    if start is not None:
        values = re.findall(r'0[fd][0-9a-fA-F]+|-?0x[0-9a-fA-F]+|-?\d+|[A-Za-z_$][\w$()]*', start)
        data = b''
        for v in values:
            if v[0].isalpha() or v[0] in '_$':
                raise Unknown(f'initial value {v}')
            number = int(v[2:], 16) if v[:2] in ('0f', '0d') else int(v, 0)
            data += (number & (1 << 8 * SIZE[kind]) - 1).to_bytes(SIZE[kind], 'little')
        data = data.ljust(size, b'\0')
    return name, size, int(align) if align else SIZE[kind], space, data


class Module:
    HEADER = re.compile(r'(?:\.(?:visible|extern|weak|hidden)\s+)*\.(entry|func)\s*(\([^)]*\))?\s*([\w$]+)\s*(\([^)]*\))?\s*([^{;]*)([{;])')

    def __init__(self, text):
        self.files = dict(re.findall(r'^\s*\.file\s+(\d+)\s+"([^"]*)"', text, re.M))
        text = re.sub(r'//[^\n]*', '', text)
        text = re.sub(r'\.section[^{]*\{[^}]*\}', '', text)
        text = re.sub(r'^\s*\.(version|target|address_size)\b[^\n]*', '', text, flags=re.M)
        self.symbols, self.functions, self.variables, self.shared = Scope(), {}, [], {}
        pieces, at = [], 0
        for m in self.HEADER.finditer(text):
            if m.start() < at:
                continue
            self.globals(text[at:m.start()])
            at = m.end()
            if m.group(6) == ';':
                continue
            depth = 1
            for brace in re.compile('[{}]').finditer(text, m.end()):
                depth += 1 if brace.group() == '{' else -1
                if depth == 0:
                    break
            pieces.append((m, text[m.end():brace.start()]))
            self.functions[m.group(3)] = None
            at = brace.end()
        self.globals(text[at:])
        self.pieces = pieces

    def globals(self, text):
        for statement in text.split(';'):
            statement = statement.strip()
            if re.match(r'(\.(visible|extern|weak|hidden|common)\s+)*\.(global|const|shared)\b', statement):
                try:
                    name, size, align, space, data = variable(statement)
                except Unknown as problem:
                    print(f'not translated: {problem}', file=sys.stderr)
                    continue
                if space == 'shared':
                    self.shared[name] = (size, align)
                    self.symbols[name] = ('shared', f'shared_{identifier(name)}')
                else:
                    self.symbols[name] = ('global', f'symbol[{len(self.variables)}]')
                    self.variables.append((name, space, size, align, data))

    def function(self, m, body):
        def parameters(text):
            found = []
            for p in (text or '').strip('() \n\t').split(','):
                if p.strip():
                    name, size, align = variable(re.sub(r'\.ptr(\s+\.(global|shared|const|local))?(\s+\.align\s+\d+)?', '', p.strip()))[:3]
                    found.append((name, size, align))
            return found
        return Function(self, m.group(3), m.group(1) == 'entry', m.group(5), parameters(m.group(2)), parameters(m.group(4)), body)

    def translate(self, folder):
        texts = {m.group(3): body for m, body in self.pieces}
        functions = {m.group(3): self.function(m, body) for m, body in self.pieces}
        index = []
        for name, space, size, align, data in self.variables:
            index.append(f'variable {name} {space} {size} {align} {data.hex() if data else "-"}')
        for number, kernel in enumerate(f for f in functions.values() if f.is_kernel):
            reached, todo = [], list(kernel.calls)
            while todo:
                name = todo.pop()
                if name in reached:
                    reached.remove(name)
                reached.append(name)
                todo += functions[name].calls
            parts = [functions[name] for name in reversed(reached)] + [kernel]
            text, shared = self.kernel_text(parts)
            with open(f'{folder}/kernel_{number}.cpp', 'w') as out:
                out.write(text)
            all_text = '\n'.join(texts[p.name] for p in parts)
            threads = re.search(r'\.(?:maxntid|reqntid)\s+([\d, ]+)', kernel.limits)
            most = 1
            for factor in (threads.group(1).split(',') if threads else ['1024']):
                most *= int(factor)
            index.append(f'kernel {number} {kernel.name} {"FIBERS" if COLLECTIVE.search(all_text) else "PLAIN"} '
                         f'{"IN_ORDER" if IN_ORDER.search(all_text) else "ANY_ORDER"} {most} {shared} '
                         + ','.join(f'{s}:{a}' for s, a in kernel.parameters))
        with open(f'{folder}/index', 'w') as out:
            out.write('\n'.join(index) + '\n')

    def kernel_text(self, parts):
        """The file of one kernel, and the bytes of static shared memory it has."""
        lines, at = ['#include "tests/gpu/emulator/ptx.h"', 'using namespace gpu_emulator;',
                     f'{VISIBLE} u64 symbol[{len(self.variables) + 1}] = {{}};'], 0
        used = [(n, s, a) for p in parts for n, s, a in p.shared_variables] + \
               [(n, s, a) for n, (s, a) in self.shared.items() if any(n in o for p in parts for o, _ in p.sites) or
                any(identifier(n) in line for p in parts for line in p.out)]
        for name, size, align in sorted(used, key=lambda v: v[1] == 0):  # dynamic memory comes last
            at = -(-at // align) * align
            lines.append(f'static constexpr u64 shared_{identifier(name)} = {at};')
            at += size
        first, sites = 0, []
        for p in parts:
            lines += [f'#define first_site {first}', p.text(), '#undef first_site']
            first += len(p.sites)
            sites += p.sites
        quoted = [', '.join('"' + re.sub(r'\s+', ' ', s).replace('\\', '/').replace('"', "'") + '"' for s in site) for site in sites]
        lines += [f'{VISIBLE} const Site sites[] = {{', *(f'{{{q}}},' for q in quoted), '{nullptr, nullptr}};']
        return '\n'.join(lines) + '\n', at


if __name__ == '__main__':
    sys.setrecursionlimit(10000)
    with open(sys.argv[1]) as source:
        Module(source.read()).translate(sys.argv[2])
