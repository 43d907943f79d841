"""The benchmark cantilever as a .feb file of FEBio 4."""

from __future__ import annotations

import cantilever

CELLS = {"P1": "tet4", "P2": "tet10", "Q1": "hex8", "Q2": "hex20"}
#: FEBio's rules of 1, 4, 8 and 27 points.
RULES = {"P1": "default", "P2": "TET10G4", "Q1": "default", "Q2": "default"}
FACETS = {"P1": "tri3", "P2": "tri6", "Q1": "quad4", "Q2": "quad8"}
LAWS = {"neo_hookean": "neo-Hookean", "saint_venant_kirchhoff": "isotropic elastic"}

_HEAD = """<?xml version="1.0" encoding="ISO-8859-1"?>
<febio_spec version="4.0">
<Module type="solid"/>
<Control>
 <analysis>STATIC</analysis><time_steps>1</time_steps><step_size>1</step_size>
 <plot_level>PLOT_NEVER</plot_level><output_level>OUTPUT_FINAL</output_level>
 <solver type="solid">
  <symmetric_stiffness>symmetric</symmetric_stiffness>
  <equation_scheme>staggered</equation_scheme>
  <lstol>0</lstol><max_refs>{most}</max_refs><diverge_reform>0</diverge_reform>
  <reform_each_time_step>1</reform_each_time_step>
  <rtol>{squared!r}</rtol><etol>0</etol><dtol>0</dtol><min_residual>1e-60</min_residual>
  <qn_method type="BFGS"><max_ups>0</max_ups></qn_method>
  <linear_solver type="pardiso"/>
 </solver>
</Control>
<Material><material id="1" name="m" type="{law}">
<density>1</density><E>{young!r}</E><v>{poisson!r}</v></material></Material>
"""

_TAIL = """<MeshDomains>
<SolidDomain name="p" mat="m" elem_type="{rule}" type="elastic-solid"/></MeshDomains>
<Boundary><bc name="clamp" node_set="held" type="zero displacement">
<x_dof>1</x_dof><y_dof>1</y_dof><z_dof>1</z_dof></bc></Boundary>
<Loads><surface_load name="t" surface="loaded" type="traction"><scale lc="1">1</scale>
<traction>0,{traction!r},0</traction><linear>1</linear></surface_load></Loads>
<LoadData><load_controller id="1" type="loadcurve"><interpolate>LINEAR</interpolate>
<points><pt>0,0</pt><pt>1,1</pt></points></load_controller></LoadData>
<Output><logfile>
<node_data data="ux;uy;uz" delim=" " file="case.disp"></node_data></logfile></Output>
</febio_spec>
"""


def text(case, element, law, parameters):
    """The file.

    Args:
        case: points (n, 3), cells and facets in VTK's order, numbers of the nodes held.
        parameters: E, Pa, and ν.
    """
    young, poisson = parameters
    head = _HEAD.format(most=cantilever.MOST, squared=cantilever.TOLERANCE**2, law=LAWS[law],
                        young=young, poisson=poisson)  # fmt: skip
    tail = _TAIL.format(rule=RULES[element], traction=cantilever.TRACTION)
    return f"{head}{_mesh(case, element)}{tail}"


def _mesh(case, element):
    nodes = _lines("node", case["points"].tolist())
    cells = _lines("elem", (case["cells"] + 1).tolist())
    facets = _lines(FACETS[element], (case["facets"] + 1).tolist())
    held = ",".join(map(str, (case["held"] + 1).tolist()))
    return (
        f'<Mesh>\n<Nodes name="n">\n{nodes}\n</Nodes>\n'
        f'<Elements type="{CELLS[element]}" name="p">\n{cells}\n</Elements>\n'
        f'<NodeSet name="held">{held}</NodeSet>\n'
        f'<Surface name="loaded">\n{facets}\n</Surface>\n</Mesh>\n'
    )


def _lines(tag, rows):
    return "\n".join(
        f'<{tag} id="{number}">{",".join(map(repr, row))}</{tag}>'
        for number, row in enumerate(rows, 1)
    )
