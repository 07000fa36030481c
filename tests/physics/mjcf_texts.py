"""Texts in MJCF: those that a scene holds, and those that it does not, each with the message."""

from __future__ import annotations


def box(attributes: str = "") -> str:
    """A geom of 2 kg."""
    return f'<geom type="box" size=".1 .2 .3" mass="2" {attributes}/>'


def floor(attributes: str = "") -> str:
    """A plane."""
    return f'<geom type="plane" size="5 5 .1" {attributes}/>'


TETRA = '<mesh name="m" vertex="0 0 0  .3 0 0  0 .4 0  0 0 .5"/>'
HILLS = '<hfield name="h" nrow="2" ncol="2" size="1 1 1 1"/>'
STRETCHED = TETRA.replace("/>", ' scale="1 2 3"/>')
START = '<key qpos="1 2 3 .5 -.5 .5 .5" qvel="1 2 3 4 5 6"/>'


def model(*bodies: str, world: str = "", before: str = "", after: str = "") -> str:
    """A text with free bodies, each the inside of its element."""
    free = "\n".join(f'<body pos="{k} 0 2"><freejoint/>{inside}</body>' for k, inside in enumerate(bodies))
    return f"<mujoco>\n{before}\n<worldbody>\n{world}\n{free}\n</worldbody>\n{after}\n</mujoco>"


def of(attributes: str, inside: str | None = None) -> str:
    """A text with one body of these attributes."""
    return f"<mujoco><worldbody><body {attributes}><freejoint/>{inside or box()}</body></worldbody></mujoco>"


def joint(attributes: str, inside: str | None = None, **around: str) -> str:
    """A text with one body whose free joint has these attributes."""
    return model(inside or box(), **around).replace("<freejoint/>", f'<joint type="free" {attributes}/>')


READ = {
    "euler": of('euler="20 30 40"'),
    "euler in radian": of('euler=".2 .3 .4"').replace("<worldbody>", '<compiler angle="radian"/><worldbody>'),
    "sequence": of('euler="20 30 40"').replace("<worldbody>", '<compiler eulerseq="zyx"/><worldbody>'),
    "axisangle": of('axisangle="0 1 1 50"'),
    "xyaxes": of('xyaxes="0 1 0 -1 0 .3"'),
    "zaxis": of('zaxis="1 2 3"'),
    "default": model(box(), world=floor(), before='<default><geom density="400" friction=".3"/></default>'),
    "class": model(
        box('class="slick"'),
        world=floor('friction="0"'),
        before='<default><default class="slick"><geom friction=".2"/></default></default>',
    ),
    "two options": model(box(), before='<option timestep=".001"/><option gravity="0 0 -1.62"/>'),
    "two worldbodies": model(box(), after=f"<worldbody>{floor()}<body><freejoint/>{box()}</body></worldbody>"),
    "gravity off": model(box(), world=floor(), before='<option><flag gravity="disable"/></option>'),
    "contact off": model(box(), box(), world=floor(), before='<option><flag contact="disable"/></option>'),
    "constraints off": model(box(), box(), world=floor(), before='<option><flag constraint="disable"/></option>'),
    "the larger friction": model(box('friction=".5"'), world=floor()),
    "the floor's friction": model(box(), world=floor('friction="8"')),
    "priority": model(box(), world=floor('friction=".2" priority="1"')),
    "condim by priority": model(box('condim="3"'), world=floor('condim="1" priority="2"')),
    "condim": model(box('condim="1"'), world=floor('condim="1"')),
    "friction of none": model(box('friction="0"'), world=floor('friction="0"')),
    "friction of boxes": model(box('friction=".3"'), box('friction=".8"'), world=floor('friction=".8"')),
    "two frictions": model(box('name="a"'), box('name="b" friction="2"'), world=floor('name="f"')),
    "frictions": model(
        box('friction=".3"'),
        box('friction=".8" priority="1"'),
        box('condim="1" friction=".1"'),
        world=floor('friction=".2"') + floor('condim="1" friction=".05" pos="0 0 -9"'),
    ),
    "frictions of pairs": model(
        *(box(f'name="{name}" friction="{mu}"') for name, mu in (("a", 0.2), ("b", 0.4), ("c", 0.6))),
        world=floor('name="f" friction=".5"'),
        after='<contact><pair geom1="a" geom2="b" condim="3" friction=".3 .3 0 0 0"/>'
        '<pair geom1="c" geom2="f" condim="1"/></contact>',
    ),
    "masks": model(box('contype="1" conaffinity="2"'), box('contype="2" conaffinity="1"')),
    "masks of walls": model(*[box('conaffinity="0"')] * 2, world=floor()),
    "pair": model(
        *(box(f'name="{name}" contype="0" conaffinity="0"') for name in "ab"),
        after='<contact><pair geom1="a" geom2="b" friction=".3 .3"/></contact>',
    ),
    "frictionless pair": model(
        box('name="a"'),
        world=floor('name="f"'),
        after='<contact><pair geom1="a" geom2="f" condim="1"/></contact>',
    ),
    "exclude": of("name='a'", box()).replace(
        "</worldbody>",
        f'{floor()}<body name="b"><freejoint/>{box()}</body></worldbody>'
        '<contact><exclude body1="a" body2="b"/></contact>',
    ),
    "override": model(
        box('friction=".1" solref="1 1"'),
        world=floor('friction=".7"'),
        before='<option o_friction=".4"><flag override="enable"/></option>',
    ),
    "hard contact": model(box('solref=".004 1"'), world=floor('solimp=".95 .99 .001"')),
    "inertia from geom": of("", '<inertial pos="0 0 0" mass="7" diaginertia="1 1 1"/>' + box()).replace(
        "<worldbody>", '<compiler inertiafromgeom="true"/><worldbody>'
    ),
    "bound mass": model(box().replace('"2"', '".01"'), before='<compiler boundmass="1"/>'),
    "bound inertia": model(box(), before='<compiler boundinertia="1"/>'),
    "balance inertia": of("", '<inertial pos="0 0 0" mass="7" diaginertia="1 1 9"/>' + box()).replace(
        "<worldbody>", '<compiler balanceinertia="true"/><worldbody>'
    ),
    "shell": model(box('shellinertia="true"')),
    "density": model('<geom type="ellipsoid" size=".1 .2 .3" density="300"/>', '<geom size=".2"/>'),
    "align": of("", box('pos=".1 0 0" euler="0 0 30"')).replace("<freejoint/>", '<freejoint align="true"/>'),
    "turned geom": model(box('pos=".1 .2 .3" euler="10 20 30"'), after=f"<keyframe>{START}</keyframe>"),
    "turned ellipsoid": of('euler="20 30 40"', '<geom type="ellipsoid" size=".1 .2 .3" mass="1" zaxis="1 1 0"/>'),
    "capsules": model(
        '<geom type="capsule" size=".1 .2"/>',
        '<geom type="capsule" size=".05" fromto="0 .1 0 .3 .2 .4" density="300"/>',
        '<inertial pos="0 0 0" mass="3" fullinertia="1 1.1 1.2 .1 .05 .02"/><geom type="capsule" size=".1 .2"/>',
    ),
    "off centre": model(
        '<inertial pos=".1 .2 .05" mass="3" fullinertia="1 1.1 1.2 .1 .05 .02"/>' + box('pos=".3 0 0"'),
        after=f"<keyframe>{START}</keyframe>",
    ),
    "fixed mass": of(
        'euler="20 30 40"',
        box()
        + (
            '<body pos="0 0 .2" euler="0 30 0">'
            '<geom type="capsule" size=".05 .1" mass="1" contype="0" conaffinity="0"/></body>'
        ),
    ),
    "frame and replicate": model(
        world=f'<frame pos="1 2 3" euler="0 0 30"><replicate count="3" offset="1 0 0"><body><freejoint/>{box()}</body>'
        "</replicate></frame>"
    ),
    "plane of a fixed body": model(
        box(), world='<body euler="30 0 0" pos="0 0 -1">' + floor('zaxis="1 0 2"') + "</body>"
    ),
    "cylinder": model('<geom type="cylinder" size=".1 .2" pos="0 0 0" euler="0 30 0"/>', world=floor()),
    "seen only": model(
        box() + '<geom type="capsule" size=".1 .2" mass="0" contype="0" conaffinity="0"/>',
        world=floor() + '<geom type="cylinder" size=".1 .2" contype="0" conaffinity="0"/>',
    ),
    "touched by none": model(box('contype="1" conaffinity="1"'), world='<geom size="1" contype="2" conaffinity="2"/>'),
    "weightless": of('gravcomp="1"'),
    "half weight": model(box(), box()).replace("<body ", '<body gravcomp=".5" '),
    "damping": joint('damping="2"', after=f"<keyframe>{START}</keyframe>"),
    "damping off": joint('damping="2"', before='<option><flag damper="disable"/></option>'),
    "friction loss off": joint('frictionloss="2"', before='<option><flag frictionloss="disable"/></option>'),
    "keyframe": model(box(), world=floor(), after=f'<keyframe>{START}<key qpos="0 0 9 1 0 0 0"/></keyframe>'),
    "wind without a medium": model(box(), before='<option wind="9 0 0"/>'),
    "harmless": model(
        box('material="x" group="2"') + '<site name="s"/>',
        before='<statistic extent="2"/><visual><map znear=".01"/></visual><asset><material name="x"/></asset>',
        world="<light/><camera/>",
        after='<custom><numeric name="a" data="1"/></custom><sensor><accelerometer site="s"/></sensor>',
    ),
    "mesh": model(
        '<geom type="mesh" mesh="m" pos=".1 0 0" euler="0 0 30"/>', world=floor(), before=f"<asset>{TETRA}</asset>"
    ),
    "scaled mesh": model('<geom type="mesh" mesh="m"/>', before=f"<asset>{STRETCHED}</asset>"),
    "heavier mesh": of(
        "", '<inertial pos=".075 .1 .125" mass="3" diaginertia="1 1.1 1.2"/><geom type="mesh" mesh="m"/>'
    ).replace("<worldbody>", f"<asset>{TETRA}</asset><worldbody>"),
}


HINGE = '<body><joint name="knee"/><geom size=".1" mass="1"/></body>'
REFUSED = {
    "fixed hills": (
        model(box(), world='<geom name="t" type="hfield" hfield="h"/>', before=f"<asset>{HILLS}</asset>"),
        "line 4: <geom 't'> is a fixed hfield",
    ),
    "two geoms": (
        model(box() + box('name="b" friction=".3"')),
        "line 5: <geom 'b'> differs in contact from another geom of its body",
    ),
    "mass elsewhere": (
        of("", box() + box('pos=".5 0 0"') + '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'),
        "<body> in a scene: the centre of mass of its 2 geoms is [0.25, 0.0, 0.0] m from that of the body",
    ),
    "no geom": (of("", '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'), "<body> has 0 geoms"),
    "hinge": (model(box(), world=HINGE), "line 4: <joint 'knee'> is a hinge"),
    "leg": (model(box() + HINGE), "line 5: <joint 'knee'> is a hinge"),
    "tendon": (
        model(
            box() + '<site name="s"/>',
            world='<site name="w"/>',
            after=('<tendon><spatial name="rope"><site site="s"/><site site="w"/></spatial></tendon>'),
        ),
        "line 7: <tendon 'rope'> has no counterpart",
    ),
    "actuator": (
        joint('name="j"', after='<actuator><motor name="m" joint="j"/></actuator>'),
        "line 7: <actuator 'm'> has no",
    ),
    "equality": (
        of('name="a"').replace("</worldbody>", '</worldbody><equality><weld name="glue" body1="a"/></equality>'),
        "<equality 'glue'> has no counterpart",
    ),
    "armature": (joint('armature="5"'), "line 5: <joint> of <body> has armature 5"),
    "friction loss": (joint('name="j" frictionloss="5"'), "line 5: <joint 'j'> has frictionloss 5"),
    "stiffness": (joint('stiffness="5"'), "has stiffness 5"),
    "damping of one": (
        joint('damping="2"').replace("</worldbody>", f"<body><freejoint/>{box()}</body></worldbody>"),
        "has damping 2; allowed is one number for all",
    ),
    "damping off centre": (joint('damping="2"', box('pos=".1 0 0"')), "has damping 2"),
    "weight of one": (
        of('gravcomp="1"').replace("</worldbody>", f"<body><freejoint/>{box()}</body></worldbody>"),
        "<body> has gravcomp 1, and others differ",
    ),
    "medium": (model(box(), before='<option density="1.2"/>'), "line 2: <option> has a medium of density 1.2"),
    "viscous medium": (
        model(box(), before='<option viscosity=".1"/>'),
        "line 2: <option> has a medium of viscosity 0.1",
    ),
    "sleep": (model(box(), before='<option><flag sleep="enable"/></option>'), "line 2: <flag> lets bodies sleep"),
    "spin friction": (model(box(), world=floor('name="f" condim="4"')), "<geom 'f'> has condim 4"),
    "bounce": (model(box('solref=".02 .1"'), world=floor()), "has solref 0.02 0.1, a soft contact"),
    "stiffness of contact": (model(box('solref="-900 0"'), world=floor()), "has solref -900 0"),
    "soft": (model(box('solimp=".1 .95 .001"'), world=floor()), "has solimp 0.1 0.95 0.001 0.5 2"),
    "margin": (model(box('margin=".1"'), world=floor()), "has margin 0.1; allowed is 0"),
    "overridden softness": (
        model(box(), world=floor(), before='<option o_solref="1 1"><flag override="enable"/></option>'),
        "<option> overrides contacts and has solref 1 1",
    ),
    "soft pair": (
        model(
            box('name="a"'),
            world=floor('name="f"'),
            after=('<contact><pair name="p" geom1="a" geom2="f" margin=".1" friction="1 1"/></contact>'),
        ),
        "line 7: <pair 'p'> has margin 0.1",
    ),
    "grain": (
        model(
            box('name="a"'),
            world=floor('name="f"'),
            after=('<contact><pair name="p" geom1="a" geom2="f" friction="1 .5"/></contact>'),
        ),
        "<pair 'p'> has friction 1 0.5 in two directions",
    ),
    "mocap": (model(box(), world=f'<body mocap="true">{floor()}</body>'), "is a plane that is moved by mocap"),
    "ball off centre": (
        of('name="b"', '<inertial pos=".1 0 0" mass="1" diaginertia="1 1 1"/><geom size=".2"/>'),
        "<body 'b'> in a scene: its sphere is [-0.1, 0.0, 0.0] m from the centre of mass",
    ),
    "mesh off centre": (
        of("", '<inertial pos=".1 0 0" mass="1" diaginertia="1 1 1"/><geom type="mesh" mesh="m"/>').replace(
            "<worldbody>", f"<asset>{TETRA}</asset><worldbody>"
        ),
        "the centre of mass of its mesh's convex hull is",
    ),
    "blank name": (of('name=" b"'), "name is ' b'; allowed are printable characters"),
    "nothing free": (
        f"<mujoco><worldbody>{floor()}</worldbody></mujoco>",
        "there is no free body that a scene can hold",
    ),
    "misspelt": (model(box('pso="0 0 9"')), "line 5: MuJoCo refuses it", "'pso'", "; pso is '0 0 9'"),
    "surplus": (
        model('<geom type="box" size="1 1 1 7"/>'),
        "line 5: MuJoCo refuses it",
        "'size'",
        "; size is '1 1 1 7'",
    ),
    "no class": (model(box('class="none"')), "line 5: MuJoCo refuses it", "'none'"),
    "no number": (model(box('contype="x"')), "line 5: MuJoCo refuses it", "; contype is 'x'"),
    "no mesh": (model('<geom type="mesh" mesh="m"/>'), "MuJoCo refuses it"),
    "cut": ("<mujoco>\n<worldbody>", "no element found: line 2"),
}
