# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on's texts in Spanish, in the order of the modules that show them.

Blender's own terms are those of its Spanish translation (procesar, preajuste, contenedor), the rest those of optics.
"""

TEXTS = {
    # words of many places
    "Negative Index": "Índice negativo",
    "Material": "Material",
    "Medium": "Medio",
    "Inside": "Interior",
    "Outside": "Exterior",
    "Interface": "Interfaz",
    "Index": "Índice",
    "Permeability": "Permeabilidad",
    "Backend": "Método",
    "Automatic": "Automático",
    "Nodes": "Nodos",
    "Sphere": "Esfera",
    "Glass": "Vaso",
    "Direction": "Dirección",
    "Width": "Ancho",
    "File": "Archivo",
    "Default": "Predefinido",
    "Problem": "Problema",
    "yes": "sí",
    "no": "no",
    "none": "ninguno",
    "Blender's own nodes": "nodos propios de Blender",
    "Select a mesh object": "Seleccionar un objeto de malla",
    "Leave the mode you are in for Object Mode first": "Primero hay que pasar al modo Objeto",
    # media
    "Air, vacuum   1": "Aire, vacío   1",
    "Water   1.33": "Agua   1.33",
    "Glass   1.5": "Vidrio   1.5",
    "Diamond   2.418": "Diamante   2.418",
    "Own values": "Valores propios",
    "The n and mu that are typed in": "Los valores de n y mu que se escriban",
    "Water (n = 1.33)": "Agua (n = 1.33)",
    "Glass (n = 1.5)": "Vidrio (n = 1.5)",
    "Diamond (n = 2.418)": "Diamante (n = 2.418)",
    "None (Empty)": "Ninguno (vacío)",
    "Own Index": "Índice propio",
    # the sockets of the interface node
    "Index Inside": "Índice interior",
    "Refractive index behind the faces; negative for a negative-index material": (
        "Índice de refracción detrás de las caras; negativo para un material de índice negativo"
    ),
    "Permeability Inside": "Permeabilidad interior",
    "Relative permeability behind the faces; its sign is that of the index and does not count here": (
        "Permeabilidad relativa detrás de las caras; su signo es el del índice y aquí no cuenta"
    ),
    "Index Outside": "Índice exterior",
    "Refractive index on the side the normals point to": "Índice de refracción del lado al que apuntan las normales",
    "Permeability Outside": "Permeabilidad exterior",
    "Relative permeability on the side the normals point to; its sign does not count here": (
        "Permeabilidad relativa del lado al que apuntan las normales; su signo aquí no cuenta"
    ),
    "Tint": "Teñir",
    "Factor on all light that meets the interface; white loses nothing": (
        "Factor sobre toda la luz que encuentra la interfaz; con blanco no se pierde nada"
    ),
    "Normal": "Normal",
    "Normal of the interface, from a bump or normal map; the surface's own where nothing is linked": (
        "Normal de la interfaz, de un mapa de relieve o de normales; la de la propia superficie si no hay nada "
        "vinculado"
    ),
    # the Add menus
    "Add Interface": "Agregar interfaz",
    "Add an interface node between this medium and air": "Agrega un nodo de interfaz entre este medio y el aire",
    "Add Negative-Index Object": "Agregar objeto de índice negativo",
    "Add a body of a negative-index material at the 3D cursor": (
        "Agrega un cuerpo de un material de índice negativo en el cursor 3D"
    ),
    "The interface node, with ready media": "El nodo de interfaz, con medios ya preparados",
    "Bodies of a negative-index material": "Cuerpos de un material de índice negativo",
    "The medium behind the faces; outside is air": "El medio detrás de las caras; el exterior es aire",
    "A ball, round to 1e-5 of its radius": "Una bola, redonda hasta 1e-5 de su radio",
    "Slab": "Lámina",
    "A plate with parallel faces, a tenth as thick as it is wide": (
        "Una lámina de caras paralelas, diez veces más ancha que gruesa"
    ),
    "Prism": "Prisma",
    "A prism over an equilateral triangle": "Un prisma sobre un triángulo equilátero",
    "Liquid": "Líquido",
    "A body of liquid: a closed cylinder with a flat top": (
        "Un cuerpo de líquido: un cilindro cerrado con la parte superior plana"
    ),
    "What it is made of; outside is air": "De qué está hecho; el exterior es aire",
    "Shape": "Forma",
    "What body to add": "Qué cuerpo agregar",
    "Size": "Tamaño",
    "Its width: the sphere's and the liquid's diameter, the slab's and the prism's side": (
        "Su ancho: el diámetro de la esfera y del líquido, el lado de la lámina y del prisma"
    ),
    "{name} of index {n} added": "Agregado: {name} de índice {n}",
    "Interface of index {n} added": "Agregada una interfaz de índice {n}",
    "Open a material in the Shader Editor first": (
        "Primero hay que abrir un material en el editor de nodos de sombreado"
    ),
    "The node tree is linked from a library: make it local first": (
        "El árbol de nodos está vinculado desde una biblioteca: primero hay que convertirlo en local"
    ),
    "The interface cannot be put into its own group": "La interfaz no se puede poner dentro de su propio grupo",
    "The active collection is linked from a library: choose another one": (
        "La colección activa está vinculada desde una biblioteca: hay que elegir otra"
    ),
    # the asset library
    "Add Asset Library": "Agregar biblioteca de recursos",
    "Show the add-on's materials and objects in the Asset Browser, as a library of their own": (
        "Muestra los materiales y objetos del complemento en el Explorador de recursos, como una biblioteca propia"
    ),
    "Remove Asset Library": "Eliminar biblioteca de recursos",
    "Take the add-on's library out of the Asset Browser; what was used of it stays in the files": (
        "Quita la biblioteca del complemento del Explorador de recursos; lo que se haya usado de ella permanece "
        "en los archivos"
    ),
    "The asset library is registered already": "La biblioteca de recursos ya está registrada",
    "The asset library is not registered": "La biblioteca de recursos no está registrada",
    "The asset library is missing from this installation: install the add-on again": (
        "La biblioteca de recursos falta en esta instalación: hay que volver a instalar el complemento"
    ),
    "{name} is in the Asset Browser's list of libraries": (
        "{name} está en la lista de bibliotecas del Explorador de recursos"
    ),
    "{name} is no longer in the Asset Browser": "{name} ya no está en el Explorador de recursos",
    # any mesh made a NIM
    "Make Negative-Index": "Hacer de índice negativo",
    "Make the selected meshes a negative-index material, one for all of them; their materials are kept for Take Back": (
        "Convierte las mallas seleccionadas en un material de índice negativo, el mismo para todas; sus "
        "materiales se guardan para Restaurar"
    ),
    "Take Back": "Restaurar",
    "Give the selected meshes the materials back that they had before they became negative-index": (
        "Devuelve a las mallas seleccionadas los materiales que tenían antes de ser de índice negativo"
    ),
    "The active object's interface in short": "La interfaz del objeto activo, en resumen",
    "The medium behind the faces": "El medio detrás de las caras",
    "The medium on the side the normals point to": "El medio del lado al que apuntan las normales",
    "The object's own material in this slot": "El material del propio objeto en este contenedor",
    "Link": "Vincular",
    "Whose material counted": "De quién era el material que contaba",
    "Mesh": "Malla",
    "The mesh's material counted": "Contaba el material de la malla",
    "Object": "Objeto",
    "The object's own material counted": "Contaba el material del propio objeto",
    "Former slots": "Contenedores anteriores",
    "The slots before the object became a NIM": "Los contenedores antes de que el objeto fuera un NIM",
    "Slot added": "Contenedor agregado",
    "The mesh had no material slot: the one it has was made for the NIM": (
        "La malla no tenía contenedor de material: el que tiene se creó para el NIM"
    ),
    "What Take Back needs to know": "Lo que Restaurar necesita saber",
    "{name} is linked from a library: make it local first": (
        "{name} está vinculado desde una biblioteca: primero hay que convertirlo en local"
    ),
    "{name} is an override of a library: make it local first": (
        "{name} es una redefinición de una biblioteca: primero hay que convertirlo en local"
    ),
    "The mesh of {name} is linked from a library and has no material slot: make it local first": (
        "La malla de {name} está vinculada desde una biblioteca y no tiene contenedor de material: primero hay "
        "que convertirla en local"
    ),
    "Select a mesh object first": "Primero hay que seleccionar un objeto de malla",
    "{count} made negative-index": "Objetos hechos de índice negativo: {count}",
    "{count} made of index {n}": "Objetos hechos de índice {n}: {count}",
    "{said}. To be mended before it renders right: {wrong}, see Checks": (
        "{said}. Por corregir antes de que se procese bien: {wrong}, ver Comprobaciones"
    ),
    "{name} is negative-index already, n = {n}: it stays as it is; change n in the panel": (
        "{name} ya es de índice negativo, n = {n}: se queda como está; n se cambia en el panel"
    ),
    "{name} has an interface already, {material}: it stays as it is": (
        "{name} ya tiene una interfaz, {material}: se queda como está"
    ),
    "Make those anew too that are negative-index already": "Hacer de nuevo también los que ya son de índice negativo",
    "None of the selected meshes was made negative-index by Make Negative-Index": (
        "Ninguna de las mallas seleccionadas se hizo de índice negativo con Hacer de índice negativo"
    ),
    "{count} given their former materials": "Objetos con sus materiales anteriores: {count}",
    "{name} has no negative-index interface.": "{name} no tiene una interfaz de índice negativo.",
    # the Negative Index panel
    "The media of both sides of the active material's interface, and what they mean": (
        "Los medios de ambos lados de la interfaz del material activo, y lo que significan"
    ),
    "The media of both sides of the edited material's interface, and what they mean": (
        "Los medios de ambos lados de la interfaz del material que se edita, y lo que significan"
    ),
    "The media of the material's interface node": "Los medios del nodo de interfaz del material",
    "Inside, behind the faces": "Interior, detrás de las caras",
    "Outside, where the normals point": "Exterior, hacia donde apuntan las normales",
    "A ready medium; n and mu can be typed below": "Un medio ya preparado; n y mu se pueden escribir debajo",
    "Refractive index; any but 0": "Índice de refracción; cualquiera menos 0",
    "Refractive index; negative for a negative-index material. To animate it, put keyframes on the node's own socket": (
        "Índice de refracción; negativo para un material de índice negativo. Para animarlo, se ponen fotogramas "
        "clave en el conector del propio nodo"
    ),
    "Relative permeability; it always has the sign of n": "Permeabilidad relativa; siempre tiene el signo de n",
    "Relative permeability; it takes the sign of n": "Permeabilidad relativa; toma el signo de n",
    "n = 0 refracts nothing: give a positive index, or a negative one for a NIM.": (
        "n = 0 no refracta nada: hay que dar un índice positivo, o uno negativo para un NIM."
    ),
    "mu = 0 has no impedance: give a positive or a negative permeability.": (
        "mu = 0 no tiene impedancia: hay que dar una permeabilidad positiva o negativa."
    ),
    "{name} is no number: give one, such as {example}.": "{name} no es un número: hay que dar uno, como {example}.",
    "{name} = {value} is out of range: without its sign it lies between {low} and {high}.": (
        "{name} = {value} está fuera de rango: sin su signo va de {low} a {high}."
    ),
    "mu set to {mu} to go with n = {n}.": "mu pasa a ser {mu} para concordar con n = {n}.",
    "from the node tree": "del árbol de nodos",
    "Light bends backwards here: n has another sign on the other side.": (
        "La luz se refracta hacia atrás: n tiene otro signo al otro lado."
    ),
    "Light goes straight on: n is the same on both sides.": "La luz sigue recta: n es igual en ambos lados.",
    "Light bends the usual way: n has the same sign on both sides.": (
        "La luz se refracta como siempre: n tiene el mismo signo en ambos lados."
    ),
    "Nothing is reflected at any angle.": "No se refleja nada a ningún ángulo.",
    "From {angle} on, all light from outside is reflected.": (
        "A partir de {angle} se refleja toda la luz que viene del exterior."
    ),
    "From {angle} on, all light from inside is reflected.": (
        "A partir de {angle} se refleja toda la luz que viene del interior."
    ),
    "No angle reflects all light.": "Ningún ángulo refleja toda la luz.",
    "Bends backwards": "Refracción hacia atrás",
    "Impedance ratio Z_t / Z_i": "Cociente de impedancias Z_t / Z_i",
    "R at normal incidence": "R con incidencia normal",
    "Critical angle": "Ángulo crítico",
    "Brewster angle, p": "Ángulo de Brewster, p",
    "Brewster angle, s": "Ángulo de Brewster, s",
    "{angle} from outside": "{angle} desde el exterior",
    "{angle} from inside": "{angle} desde el interior",
    "R over the angle of incidence. Solid: from outside; dashed: from inside.": (
        "R según el ángulo de incidencia. Línea continua: desde el exterior; a trazos: desde el interior."
    ),
    "The node tree decides n or mu, point by point: there is no one curve to show.": (
        "El árbol de nodos decide n o mu, punto por punto: no hay una sola curva que mostrar."
    ),
    "Rendered by": "Se procesa con",
    "This material has no negative-index interface.": "Este material no tiene una interfaz de índice negativo.",
    "There is no material yet.": "Todavía no hay ningún material.",
    "The material is linked from a library: change it in that file.": (
        "El material está vinculado desde una biblioteca: se cambia en ese archivo."
    ),
    "Switch Backend": "Cambiar método",
    "Render the material by another backend, OSL or Blender's own nodes; its values and links stay": (
        "Procesa el material con otro método, OSL o los nodos propios de Blender; sus valores y vínculos permanecen"
    ),
    "Name of the material": "Nombre del material",
    "What the optics are made of": "De qué está hecha la óptica",
    "OSL where the scene has it turned on and the device can run it, else nodes": (
        "OSL si la escena lo tiene activado y el dispositivo puede ejecutarlo; si no, nodos"
    ),
    "The closure in the Open Shading Language": "El cierre en Open Shading Language",
    "The same optics in Blender's own nodes, for any build and device": (
        "La misma óptica en nodos propios de Blender, para cualquier versión y dispositivo"
    ),
    "No material here has a negative-index interface": (
        "Ningún material de este archivo tiene una interfaz de índice negativo"
    ),
    "{name} is no material with an interface that can be changed here": (
        "{name} no es un material con una interfaz que se pueda cambiar aquí"
    ),
    "This Blender was built without OSL; choose nodes, or use a build from blender.org": (
        "Este Blender se compiló sin OSL; hay que elegir nodos, o usar una versión de blender.org"
    ),
    # what would spoil the picture
    "Checks": "Comprobaciones",
    "What would spoil the picture": "Lo que estropearía la imagen",
    "Mend": "Corregir",
    "Mend what would spoil the picture of a negative-index material": (
        "Corrige lo que estropearía la imagen de un material de índice negativo"
    ),
    "Mend All": "Corregir todo",
    "Which problem to mend; all of them if empty": "Qué problema corregir; todos si está vacío",
    "Mending needs Object Mode": "Para corregir hay que estar en el modo Objeto",
    "There was nothing to mend": "No había nada que corregir",
    "Mended: {count}, left: {left}": "Corregidos: {count}, quedan: {left}",
    "Mended: {count}, nothing is left": "Corregidos: {count}, no queda ninguno",
    "Check Large Meshes": "Comprobar mallas grandes",
    "Look at the large meshes of interface materials too: are they closed, do their normals and media fit": (
        "Examina también las mallas grandes con materiales de interfaz: si están cerradas, si sus normales "
        "y sus medios encajan"
    ),
    "All meshes of interface materials have been checked": (
        "Todas las mallas con materiales de interfaz están comprobadas"
    ),
    "Meshes checked: {count}, problems: {wrong}": "Mallas comprobadas: {count}, problemas: {wrong}",
    "Looking...": "Examinando...",
    "No interface in this scene yet": "Aún no hay interfaces en esta escena",
    "Nothing to mend": "Nada que corregir",
    "It is linked from a library: mend it in that file.": (
        "Está vinculado desde una biblioteca: se corrige en ese archivo."
    ),
    "A modifier makes it so, not the mesh itself: mend it there.": (
        "Se debe a un modificador, no a la propia malla: se corrige en él."
    ),
    "{engine} draws this view and cannot bend a ray backwards: its interfaces are wrong. Use Rendered, with Cycles.": (
        "{engine} dibuja esta vista y no puede desviar un rayo hacia atrás: sus interfaces son incorrectas. Hay que usar "
        "Procesado, con Cycles."
    ),
    "Show It Rendered": "Mostrarla procesada",
    "Let Cycles draw this view: only it bends rays backwards": (
        "Hacer que Cycles dibuje esta vista: solo él desvía los rayos hacia atrás"
    ),
    "Cycles is switched off in the preferences: only Cycles renders the interface.": (
        "Cycles está desactivado en las preferencias: solo Cycles procesa la interfaz."
    ),
    "{engine} cannot bend a ray at the interface: only Cycles renders it.": (
        "{engine} no puede refractar un rayo en la interfaz: solo Cycles la procesa."
    ),
    "Use Cycles": "Usar Cycles",
    "This Blender was built without OSL, which the material's script needs.": (
        "Este Blender se compiló sin OSL, que el script del material necesita."
    ),
    "This GPU does not run OSL, which the material's script needs: only the CPU and OptiX do.": (
        "Esta GPU no ejecuta OSL, que el script del material necesita: solo lo hacen la CPU y OptiX."
    ),
    "Use nodes": "Usar nodos",
    "Open Shading Language is off, which the material's script needs.": (
        "Open Shading Language está desactivado, y el script del material lo necesita."
    ),
    "Turn on OSL": "Activar OSL",
    "Transparent bounces: {worst}. Each bend backwards is one, and after the last the path is black.": (
        "Rebotes de transparencia: {worst}. Cada refracción hacia atrás cuenta como uno, y tras el último la "
        "trayectoria queda negra."
    ),
    "Raise them": "Aumentarlos",
    "Light bounces: {worst}. Each reflection and each bend forwards is one, and after the last the path is black.": (
        "Rebotes de luz: {worst}. Cada reflexión y cada refracción hacia delante cuenta como uno, y tras el último la "
        "trayectoria queda negra."
    ),
    "Diffuse bounces: 0. Light that has passed an interface is then missing on matt surfaces.": (
        "Rebotes difusos: 0. En las superficies mates falta entonces la luz que ha atravesado una interfaz."
    ),
    "Caustics are off: light that was mirrored or bent at an interface is missing on matt surfaces.": (
        "Las cáusticas están desactivadas: en las superficies mates falta la luz reflejada o refractada en una interfaz."
    ),
    "Turn on caustics": "Activar las cáusticas",
    "Fast GI Approximation ends paths early, and makes up what they would have met.": (
        "La aproximación rápida de iluminación global acaba antes las trayectorias e inventa lo que encontrarían."
    ),
    "Turn it off": "Desactivarlo",
    "Adaptive Sampling stops where it has met no light yet: a small light through an interface is missing.": (
        "El muestreo adaptativo se detiene donde aún no ha encontrado luz: falta una luz pequeña tras una interfaz."
    ),
    "Clamping dims what is mirrored but not what is bent backwards: their balance is wrong.": (
        "La limitación atenúa lo reflejado pero no lo refractado hacia atrás: su proporción es incorrecta."
    ),
    "Turn off clamping": "Desactivar la limitación",
    "Filter Glossy blurs what is mirrored but not what is bent backwards.": (
        "Filtrar reflejos desenfoca lo reflejado pero no lo refractado hacia atrás."
    ),
    "Turn off the filter": "Desactivar el filtro",
    "The film is transparent: a negative-index material shows as a hole in it.": (
        "La película es transparente: un material de índice negativo aparece en ella como un agujero."
    ),
    "Make the film opaque": "Hacer opaca la película",
    "The light {name} has no size: it is never seen through the interface and casts no light through it.": (
        "La luz {name} no tiene tamaño: nunca se ve a través de la interfaz ni la atraviesa con su luz."
    ),
    "Give it a size": "Darle un tamaño",
    "Multiple Importance of the light {name} is off: it casts no light through an interface.": (
        "La importancia múltiple de la luz {name} está desactivada: no envía luz a través de una interfaz."
    ),
    "Turn it on": "Activarla",
    "The light {name} casts no shadows: it passes straight through an interface, and bent once more.": (
        "La luz {name} no proyecta sombras: atraviesa la interfaz en línea recta, y otra vez desviada."
    ),
    "Let it cast shadows": "Dejarla proyectar sombras",
    "Shadow linking lets the light {name} straight through {passed}, and bent once more.": (
        "El enlazado de sombras deja pasar la luz {name} en línea recta por {passed}, y otra vez desviada."
    ),
    "{name} is invisible to shadow rays: light passes straight through it, and bent once more.": (
        "{name} es invisible para los rayos de sombra: la luz lo atraviesa en línea recta, y otra vez desviada."
    ),
    "{name} is invisible to diffuse rays: light that it sends to matt surfaces is wrong.": (
        "{name} es invisible para los rayos difusos: la luz que envía a superficies mates es incorrecta."
    ),
    "{name} is invisible to glossy rays: it is missing in mirrors and in its own reflections.": (
        "{name} es invisible para los rayos reflejados: falta en los espejos y en sus propios reflejos."
    ),
    "{name} is invisible to transmission rays: behind glass or water it is missing.": (
        "{name} es invisible para los rayos de transmisión: falta detrás de vidrio o agua."
    ),
    "Make it visible": "Hacerlo visible",
    "The shading offset of the shadow terminator darkens {name}, as if its interface took light away.": (
        "El desplazamiento de sombreado del terminador oscurece {name}, como si su interfaz quitara luz."
    ),
    "Set it to 0": "Ponerlo a 0",
    "Shadow Caustics do not know light that bends backwards: the light that {name} casts is missing.": (
        "Las cáusticas de sombra no conocen la luz que se desvía hacia atrás: falta la luz que proyecta {name}."
    ),
    "Turn them off for it": "Desactivarlas para él",
    "The world {name} is invisible to rays that an interface mirrors or bends: they meet black.": (
        "El entorno {name} es invisible para los rayos que una interfaz refleja o desvía: encuentran negro."
    ),
    "View layer {layer} puts {material} in the place of all materials: no interface is rendered.": (
        "La capa de visualización {layer} pone {material} en lugar de todos los materiales: no se procesa interfaz alguna."
    ),
    "Take the override away": "Quitar el material sustituto",
    "Only the view layer {layer} shows {name}: checks, caustics and light paths look at the first one, {first}.": (
        "Solo la capa de visualización {layer} muestra {name}: las comprobaciones, las cáusticas y los rayos miran la "
        "primera, {first}."
    ),
    "{material} takes the heights of its bumps a whole pixel apart: small ones lose up to 8 % of the light.": (
        "{material} toma las alturas de su relieve a un píxel entero de distancia: el relieve fino pierde hasta un 8 % de la luz."
    ),
    "Render it larger, or in Blender 4.5 or later.": "Procésalo más grande, o con Blender 4.5 o posterior.",
    "Narrow the filter": "Estrechar el filtro",
    "View layer {layer} renders {samples} samples, not the {all} of the scene.": (
        "La capa de visualización {layer} procesa {samples} muestras, no las {all} de la escena."
    ),
    "Use the scene's": "Usar las de la escena",
    "{material} is transparent to shadow rays: light passes straight through it, and bent once more.": (
        "{material} es transparente para los rayos de sombra: la luz lo atraviesa en línea recta, y otra vez desviada."
    ),
    "{material}: {socket} is {value}, which refracts nothing.": (
        "{material}: {socket} es {value}, que no refracta nada."
    ),
    "{material}: {socket} is {value} on frame {frame}, which refracts nothing.": (
        "{material}: {socket} es {value} en el fotograma {frame}, que no refracta nada."
    ),
    "{material}: {socket} is {value}, which is out of range.": "{material}: {socket} es {value}, fuera de rango.",
    "{material}: {socket} is {value} on frame {frame}, which is out of range.": (
        "{material}: {socket} es {value} en el fotograma {frame}, fuera de rango."
    ),
    "{material}: {socket} passes through 0 before frame {frame}, where nothing is refracted.": (
        "{material}: {socket} pasa por 0 antes del fotograma {frame}, donde nada se refracta."
    ),
    "{material}: the tint is {value}, but an interface passes between 0 and 1 of the light.": (
        "{material}: el tinte es {value}, pero una interfaz deja pasar entre 0 y 1 de la luz."
    ),
    "{material}: on frame {frame} the tint is {value}, but it lies between 0 and 1.": (
        "{material}: en el fotograma {frame} el tinte es {value}, pero está entre 0 y 1."
    ),
    "Bring it into range": "Llevarlo al rango",
    "The normals of {name} point inwards, so that inside and outside are exchanged.": (
        "Las normales de {name} apuntan hacia dentro: el interior y el exterior están intercambiados."
    ),
    "The normals of {name} do not agree, so that inside and outside are exchanged here and there.": (
        "Las normales de {name} no concuerdan: el interior y el exterior están intercambiados en algunas partes."
    ),
    "Some parts of {name} are inside out: {count} of {parts}.": (
        "Algunas partes de {name} están vueltas del revés: {count} de {parts}."
    ),
    "{name} lies in the medium that it has inside itself: its normals should point inwards.": (
        "{name} está dentro del mismo medio que tiene en su interior: sus normales deberían apuntar hacia dentro."
    ),
    "Turn them out": "Volverlas hacia fuera",
    "Turn them in": "Volverlas hacia dentro",
    "Another object needs the same mesh as it is: make it a mesh of its own first.": (
        "Otro objeto necesita la misma malla tal como está: dale primero una malla propia."
    ),
    "{name} has holes, but its material has a volume, which then has no end.": (
        "{name} tiene agujeros, pero su material tiene un volumen, que así no tiene fin."
    ),
    "{name} has holes: light that goes through them is in the wrong medium.": (
        "{name} tiene agujeros: la luz que pasa por ellos está en el medio equivocado."
    ),
    "{name} is a sheet with nothing at its rim, so that light goes round it: close it to a body, or let it "
    "end at something.": (
        "{name} es una lámina sin nada en su borde, de modo que la luz la rodea: ciérrala como un cuerpo o haz que "
        "acabe en algo."
    ),
    "Close the holes": "Cerrar los agujeros",
    "No button can fill it: do it by hand in Edit Mode.": (
        "Ningún botón puede rellenarlo: hazlo a mano en el modo Edición."
    ),
    "{name} has {count} faces twice in the same place, so that one or the other is met by chance.": (
        "{name} tiene {count} caras dos veces en el mismo lugar, de modo que se encuentra una u otra al azar."
    ),
    "Remove the second ones": "Eliminar las repetidas",
    "{name} and {other} have faces in the same place, of which one or the other is met: move one a little.": (
        "{name} y {other} tienen caras en el mismo lugar, de las que se encuentra una u otra: mueve una un poco."
    ),
    "Move it a little": "Moverlo un poco",
    "{name} and {other} are in the same place, where one or the other is met: move or remove one.": (
        "{name} y {other} están en el mismo lugar, donde se encuentra uno u otro: mueve o elimina uno."
    ),
    "{name} is coarse for a smooth surface: faces differ by {angle:.0f} degrees, and what it shows is some "
    "{error:.0f} % off: subdivide it, or shade it flat.": (
        "{name} es tosco para una superficie suave: las caras difieren en {angle:.0f} grados y lo que muestra se "
        "desvía un {error:.0f} %: subdivídelo o sombréalo plano."
    ),
    "{name} is {times:,.0f} times its size away from the origin, too far for the numbers of a render: move "
    "everything there.": (
        "{name} está a {times:,.0f} veces su tamaño del origen, demasiado lejos para los números de un render: "
        "muévelo todo allí."
    ),
    # media that do not fit
    "{name} lies in {medium} ({other}), but its outside is {own}.": (
        "{name} está dentro de {medium} ({other}), pero su exterior es {own}."
    ),
    "{name} and {more} more lie in {medium} ({other}), but their outside is {own}.": (
        "{name} y {more} más están dentro de {medium} ({other}), pero su exterior es {own}."
    ),
    "{name} lies partly in {medium} ({other}), but its outside is {own}: it takes a material for each part.": (
        "{name} está en parte dentro de {medium} ({other}), pero su exterior es {own}: necesita un material por parte."
    ),
    "{name} and {more} more lie partly in {medium} ({other}), but their outside is {own}: each part takes a material.": (
        "{name} y {more} más están en parte dentro de {medium} ({other}), pero su exterior es {own}: cada parte "
        "necesita un material."
    ),
    "{name} and {other} overlap: where they do, there are two media in one place.": (
        "{name} y {other} se solapan: donde lo hacen hay dos medios en un mismo lugar."
    ),
    "{name}, {more} more and {other} overlap: where they do, there are two media in one place.": (
        "{name}, {more} más y {other} se solapan: donde lo hacen hay dos medios en un mismo lugar."
    ),
    "Parts of {name} overlap: where they do, there are two media in one place.": (
        "Hay partes de {name} que se solapan: donde lo hacen hay dos medios en un mismo lugar."
    ),
    "{name} and {other} face each other, but the outside of the first is {own}, of the second {medium}.": (
        "{name} y {other} están frente a frente, pero el exterior del primero es {own} y el del segundo {medium}."
    ),
    "{name} and {more} more face {other}, but their outside is {own}, and its outside {medium}.": (
        "{name} y {more} más están frente a {other}, pero su exterior es {own}, y el de este {medium}."
    ),
    "{name} and {other} have their inside in common, but that of the first is {own}, of the second {medium}.": (
        "{name} y {other} tienen el interior en común, pero el del primero es {own} y el del segundo {medium}."
    ),
    "{name}, {more} more and {other} have their inside in common, but theirs is {own}, and its {medium}.": (
        "{name}, {more} más y {other} tienen el interior en común, pero el de ellos es {own} y el de este {medium}."
    ),
    "Set the outside": "Poner el exterior",
    "Set the inside": "Poner el interior",
    # the scenes panel
    "Scenes": "Escenas",
    "Choose a scene, set it, build it.": "Elegir una escena, ajustarla y construirla.",
    "NIM Scenes": "Escenas NIM",
    "Settings of the NIM scenes panel": "Ajustes del panel de escenas NIM",
    "Scene": "Escena",
    "Which scene to build": "Qué escena construir",
    "a straw in a glass on a table, filled with water, a NIM or nothing (thesis 5.1, 5.2, 5.5)": (
        "una pajita en un vaso sobre una mesa, lleno de agua, de un NIM o vacío (tesis 5.1, 5.2, 5.5)"
    ),
    "a tiled swimming pool, from outside or from under the surface (thesis 5.3, 5.7, 5.9, 5.10)": (
        "una piscina con azulejos, desde fuera o desde debajo de la superficie (tesis 5.3, 5.7, 5.9, 5.10)"
    ),
    "a transparent sphere on a patterned ground (thesis 5.4, 5.6)": (
        "una esfera transparente sobre un suelo con dibujo (tesis 5.4, 5.6)"
    ),
    "the open sea from below its surface (thesis 2.4)": "el mar abierto desde debajo de su superficie (tesis 2.4)",
    "Parameters of the glass": "Parámetros del vaso",
    "Pool": "Piscina",
    "Parameters of the pool": "Parámetros de la piscina",
    "Sea": "Mar",
    "Parameters of the sea": "Parámetros del mar",
    "Parameters of the sphere": "Parámetros de la esfera",
    "What fills the glass: none, water, nim or any index": "Qué llena el vaso: nada, agua, un NIM o cualquier índice",
    "View": "Vista",
    "Where the camera looks from": "Desde dónde mira la cámara",
    "Side": "Lado",
    "Top": "Superior",
    "Window": "Ventana",
    "Straw": "Pajita",
    "The straw in the glass": "La pajita en el vaso",
    "Figures": "Figuras",
    "Three small statues around the glass: Blender's monkey or a mesh of your own": (
        "Tres estatuillas alrededor del vaso: la mona de Blender o una malla propia"
    ),
    "None": "Ninguno",
    "Monkey": "Mona",
    "A PLY, OBJ or STL file": "Un archivo PLY, OBJ o STL",
    "What fills the pool: none, water, nim, an index, or n=-1.33,mu=-10": (
        "Qué llena la piscina: nada, agua, un NIM, un índice, o n=-1.33,mu=-10"
    ),
    "Refractive index of the liquid; negative for a NIM": "Índice de refracción del líquido; negativo para un NIM",
    "Relative permeability of the liquid; it has the sign of the index": (
        "Permeabilidad relativa del líquido; tiene el signo del índice"
    ),
    "Relative permeability of the liquid; the liquid's own if left out": (
        "Permeabilidad relativa del líquido; si se omite, la propia del líquido"
    ),
    "Own Permeability": "Permeabilidad propia",
    "Set it here, rather than leave it to the rest": "Fijarla aquí, en vez de dejar que la decidan los demás ajustes",
    "Set it here; else it is 1 with the sign of the index": "Fijarla aquí; si no, es 1 con el signo del índice",
    "Where the eye is: beside the pool, above it, under water": (
        "Dónde está el ojo: junto a la piscina, encima de ella o bajo el agua"
    ),
    "Sky": "Cielo",
    "The light: a grey sky, or a blue one with the sun": "La luz: un cielo gris, o uno azul con el sol",
    "Overcast": "Nublado",
    "Sunny": "Soleado",
    "Sun Angle (°)": "Ángulo sol (°)",
    "Width of the sun; its light stays the same, in degrees": "Ancho del sol; su luz sigue siendo la misma, en grados",
    "Waves": "Ondas",
    "Height of the waves, lowest trough to highest crest at time 0; 0 is calm, in m": (
        "Altura de las ondas, del valle más bajo a la cresta más alta en el instante 0; 0 es en calma, en m"
    ),
    "Seed": "Semilla",
    "Which waves: the same number gives the same surface": "Qué ondas: el mismo número da la misma superficie",
    "Time": "Tiempo",
    "How long the waves have moved on, in s": "Cuánto tiempo llevan avanzando las ondas, en s",
    "What the sea is made of: none, water, nim, an index, or n=-1.33,mu=-10": (
        "De qué es el mar: nada, agua, un NIM, un índice, o n=-1.33,mu=-10"
    ),
    "Where the eye under water looks: straight up, or obliquely": (
        "Hacia dónde mira el ojo bajo el agua: recto hacia arriba u oblicuamente"
    ),
    "Up": "Arriba",
    "Oblique": "Oblicua",
    "Height of the waves, four times the standard deviation; 0 is calm, in m": (
        "Altura de las ondas, cuatro veces la desviación típica; 0 es en calma, en m"
    ),
    "Refractive index of the sphere": "Índice de refracción de la esfera",
    "Relative permeability of the sphere; the sign of n if left out": (
        "Permeabilidad relativa de la esfera; si se omite, el signo de n"
    ),
    "Companions": "Acompañantes",
    "An opaque red sphere behind, a blue one in front": "Una esfera roja opaca detrás y una azul delante",
    "Quality": "Calidad",
    "Samples a pixel and size of the picture; a built scene follows at once": (
        "Muestras por píxel y tamaño de la imagen; una escena ya construida cambia enseguida"
    ),
    "The samples of the add-on's preferences, full size": (
        "Las muestras de las preferencias del complemento, tamaño completo"
    ),
    "Draft": "Borrador",
    "32 samples, half size: seconds": "32 muestras, mitad de tamaño: segundos",
    "Good": "Buena",
    "256 samples, full size: minutes": "256 muestras, tamaño completo: minutos",
    "Final": "Final",
    "2048 samples, full size: as long as it takes": "2048 muestras, tamaño completo: lo que haga falta",
    "What the optics of the materials are made of": "De qué está hecha la óptica de los materiales",
    "As in the add-on's preferences": "Como en las preferencias del complemento",
    "OSL where this Blender has it, else Blender's own nodes": (
        "OSL si este Blender lo tiene; si no, los nodos propios de Blender"
    ),
    "The closure written in Open Shading Language": "El cierre escrito en Open Shading Language",
    "Blender's own nodes, which run in any build": "Los nodos propios de Blender, que funcionan en cualquier versión",
    "What clashes in the settings; empty if nothing": "Qué se contradice en los ajustes; vacío si nada",
    "Build": "Construir",
    "Build the chosen scene in a Blender scene of its own, and show it through its camera": (
        "Construye la escena elegida en una escena de Blender propia, y la muestra a través de su cámara"
    ),
    "There is no scene": "No hay ninguna escena",
    "Replace the scene?": "¿Reemplazar la escena?",
    "{} is there already. What you added stays, changes to its own objects go.": (
        "{} ya existe. Lo que se haya agregado permanece; los cambios en sus propios objetos se pierden."
    ),
    "Replace": "Reemplazar",
    "Built {}": "Construida: {}",
    "Copy as Command": "Copiar como comando",
    "Put the nimray command that renders this scene with these settings on the clipboard": (
        "Pone en el portapapeles el comando nimray que procesa esta escena con estos ajustes"
    ),
    "Copied: {}": "Copiado: {}",
    # presets
    "Presets": "Preajustes",
    "Presets of the glass scene.": "Preajustes de la escena del vaso.",
    "Presets of the pool scene.": "Preajustes de la escena de la piscina.",
    "Presets of the sea scene.": "Preajustes de la escena del mar.",
    "Presets of the sphere scene.": "Preajustes de la escena de la esfera.",
    "Load Preset": "Cargar preajuste",
    "Take the settings of this preset; Build shows them": "Toma los ajustes de este preajuste; Construir los muestra",
    "The preset's file": "El archivo del preajuste",
    "Menu": "Menú",
    "The menu it is chosen from": "El menú del que se elige",
    "{} is no preset of this scene.": "{} no es un preajuste de esta escena.",
    "Save Preset": "Guardar preajuste",
    "Save these settings as a preset of your own, or remove the one that was loaded last": (
        "Guarda estos ajustes como preajuste propio, o elimina el último que se cargó"
    ),
    "Save these settings as a preset of your own": "Guarda estos ajustes como preajuste propio",
    "Remove the preset that was loaded last, if it is one of your own": (
        "Elimina el último preajuste que se cargó, si es propio"
    ),
    "Give the preset a name.": "Hay que dar un nombre al preajuste.",
    "{} is not one of your own presets, so it stays.": "{} no es un preajuste propio, así que permanece.",
    "There is a preset {} already; choose another name.": "Ya hay un preajuste {}; hay que elegir otro nombre.",
    "Removed the preset {}": "Preajuste eliminado: {}",
    "Saved the preset {}": "Preajuste guardado: {}",
    # headless renders
    "Headless Render": "Procesamiento sin ventana",
    "Headless renders: start, progress, result.": "Procesamientos sin ventana: inicio, progreso, resultado.",
    "Render Headless": "Procesar sin ventana",
    "Render these settings in a second Blender without a window, while this one stays free": (
        "Procesa estos ajustes en un segundo Blender sin ventana, mientras este queda libre"
    ),
    "Render All Variants": "Procesar todas las variantes",
    "Render the scene empty, with water and with a NIM, headless, and side by side into one image": (
        "Procesa la escena vacía, con agua y con un NIM, sin ventana, y las pone juntas en una sola imagen"
    ),
    "A render is under way; wait for it, or cancel it": "Hay un procesamiento en curso; hay que esperar o cancelarlo",
    "Starting": "Comenzando",
    "{}, {} left": "{}, faltan {}",
    "Rendering {} in the background": "Procesando {} en segundo plano",
    "A second Blender could not be started: {}": "No se pudo iniciar un segundo Blender: {}",
    "The render ended without a word (exit code {}).": (
        "El procesamiento terminó sin decir nada (código de salida {})."
    ),
    "Cancel": "Cancelar",
    "End the headless render; no half image is left": (
        "Termina el procesamiento sin ventana; no queda ninguna imagen a medias"
    ),
    "No headless render is under way": "No hay ningún procesamiento sin ventana en curso",
    "Cancelled": "Cancelado",
    "Cancelled {}": "Cancelado: {}",
    "No headless render has been finished yet": "Aún no ha terminado ningún procesamiento sin ventana",
    "Open Result": "Abrir resultado",
    "Show the finished image in an Image editor": "Muestra la imagen terminada en un editor de imágenes",
    "There is no {} any more; was it moved?": "Ya no existe {}; ¿se movió?",
    "Opened {}": "Abierto: {}",
    "Open Folder": "Abrir carpeta",
    "Open the folder of the headless renders in the file browser of this system": (
        "Abre la carpeta de los procesamientos sin ventana en el explorador de archivos del sistema"
    ),
    "The folder {} cannot be opened.": "La carpeta {} no se puede abrir.",
    # caustics
    "Caustics": "Cáusticas",
    "Light that interfaces and mirrors gather on surfaces, traced from the lamps": (
        "Luz que las interfaces y los espejos concentran en las superficies, trazada desde las luces"
    ),
    "How the caustics of this scene are traced": "Cómo se trazan las cáusticas de esta escena",
    "Million Photons": "Millones de fotones",
    "How many are traced from all lamps together, in millions; more of them draw finer lines": (
        "Cuántos se trazan desde todas las luces juntas, en millones; con más, las líneas son más finas"
    ),
    "Texture Size": "Tamaño de textura",
    "Edge of the texture of the surface where most light lands; the others get as many texels a photon": (
        "Lado de la textura de la superficie que recibe más luz; las demás tienen otros tantos téxeles por fotón"
    ),
    "4 MB for the largest surface": "4 MB para la superficie mayor",
    "16 MB for the largest surface": "16 MB para la superficie mayor",
    "64 MB for the largest surface": "64 MB para la superficie mayor",
    "256 MB for the largest surface": "256 MB para la superficie mayor",
    "Another number gives other noise": "Otro número da otro ruido",
    "Laying it down...": "Aplicando la luz...",
    "its sun": "su sol",
    "Bake Caustics": "Capturar cáusticas",
    "Bake Again": "Capturar de nuevo",
    "Trace light from the lamps through interfaces and by mirrors, and let the surfaces shine where it lands. It takes "
    "the place of the last render in the Image editor": (
        "Traza la luz de las luces a través de interfaces y por espejos, y hace brillar las superficies donde llega. "
        "Ocupa el lugar del último procesamiento en el editor de imágenes"
    ),
    "Caustics are being baked; Esc stops it": "Se están capturando cáusticas; Esc lo detiene",
    "The caustics are up to date": "Las cáusticas están al día",
    "The scene was changed while it was traced; bake it again.": (
        "La escena cambió mientras se trazaba; hay que capturarla de nuevo."
    ),
    "Stopped before anything could be seen; nothing is changed": "Detenido antes de ver nada; no cambia nada",
    "Caustics baked: {millions} million photons in {time}": (
        "Cáusticas capturadas: {millions} millones de fotones en {time}"
    ),
    "Caustics: {}. Esc: stop, and keep what is traced": "Cáusticas: {}. Esc: detener y conservar lo trazado",
    "Esc: stop, and keep what is traced": "Esc: detener y conservar lo trazado",
    "Clear Caustics": "Eliminar cáusticas",
    "Take the baked caustics out of this scene; its surfaces and lamps are as before": (
        "Elimina las cáusticas capturadas de esta escena; sus superficies y luces quedan como antes"
    ),
    "This scene has no baked caustics": "Esta escena no tiene cáusticas capturadas",
    "Caustics cleared": "Cáusticas eliminadas",
    "No caustics yet": "Aún no hay cáusticas",
    "Out of date: the scene has changed since": "Desactualizadas: la escena cambió después",
    "Up to date": "Al día",
    "{millions} million photons in {time}": "{millions} millones de fotones en {time}",
    "Surfaces: {count}, {size:.0f} MB": "Superficies: {count}, {size:.0f} MB",
    "No lamp shines here: add a sun, a point, a spot or an area": (
        "Aquí no alumbra ninguna luz: agregar un sol, un punto, un foco o un área"
    ),
    # light paths
    "Light Paths": "Trayectoria de rayos",
    "Rays through the interfaces of the scene, drawn as curves": (
        "Rayos a través de las interfaces de la escena, dibujados como curvas"
    ),
    "How the light paths of this scene are drawn": "Cómo se dibujan las trayectorias de rayos de esta escena",
    "Source": "Origen",
    "Where the rays start": "Dónde empiezan los rayos",
    "From the Side": "Desde un lado",
    "From outside, beside the interface as the camera sees it; from above, at a slant, if it is flat": (
        "Desde fuera, al lado de la interfaz tal como la ve la cámara; desde arriba, inclinado, si es plana"
    ),
    "3D Cursor": "Cursor 3D",
    "From the 3D cursor; from its left (-X) if it is in the target's middle": (
        "Desde el cursor 3D; desde su izquierda (-X) si está en el centro del objetivo"
    ),
    "Camera": "Cámara",
    "From the scene's camera, against the light it sees": "Desde la cámara de la escena, en contra de la luz que ve",
    "Selected Lamps": "Luces seleccionadas",
    "From every selected lamp; from the only lamp, where none is": (
        "Desde cada luz seleccionada; si no hay ninguna, desde la única luz que haya"
    ),
    "Aim": "Apuntar a",
    "Where the rays go; those of a sun always go where it shines": (
        "Hacia dónde van los rayos; los de un sol van siempre hacia donde alumbra"
    ),
    "Towards the active object, or all interfaces if it is none": (
        "Hacia el objeto activo, o hacia todas las interfaces si no es una"
    ),
    "Forward": "Avance",
    "Where the camera looks, the lamp shines or the cursor's -Z points": (
        "Hacia donde mira la cámara, alumbra la luz o apunta el eje -Z del cursor"
    ),
    "Along a direction of your own": "En una dirección propia",
    "Direction of the rays in the scene's axes, of any length but zero": (
        "Dirección de los rayos en los ejes de la escena, de cualquier longitud menos cero"
    ),
    "Arrangement": "Disposición",
    "How the rays spread; those of a sun are always parallel": (
        "Cómo se reparten los rayos; los de un sol son siempre paralelos"
    ),
    "Beam": "Haz",
    "Parallel rays side by side in a plane": "Rayos paralelos, uno junto a otro en un plano",
    "Fan": "Abanico",
    "Rays from one point in a plane": "Rayos desde un punto en un plano",
    "Cone": "Cono",
    "Rays from one point, evenly within a cone": "Rayos desde un punto, repartidos por igual en un cono",
    "Rays": "Rayos",
    "How many rays start at each source": "Cuántos rayos salen de cada origen",
    "Width of a beam": "Ancho de un haz",
    "Angle": "Ángulo",
    "Angle between the outermost rays of a fan or a cone": "Ángulo entre los rayos exteriores de un abanico o un cono",
    "Roll": "Giro",
    "Turns the plane of a beam or a fan about its middle ray; at 0 it stands upright": (
        "Gira el plano de un haz o un abanico alrededor de su rayo central; con 0 está vertical"
    ),
    "Bounces": "Rebotes",
    "How many interfaces a path may cross or be reflected by": (
        "Cuántas interfaces puede atravesar una trayectoria, o cuántas veces reflejarse en ellas"
    ),
    "Least Energy": "Energía mínima",
    "A branch with less than this share of its ray's energy is not drawn": (
        "Una rama con menos de esta parte de la energía de su rayo no se dibuja"
    ),
    "Fit to Interfaces": "Ajustar a interfaces",
    "Choose the width of a beam, the thickness and the reach by the size of what the rays meet": (
        "Elige el ancho de un haz, el grosor y el alcance según el tamaño de lo que encuentran los rayos"
    ),
    "Thickness": "Grosor",
    "Thickness of a ray with all its energy; weaker ones are thinner": (
        "Grosor de un rayo con toda su energía; los más débiles son más finos"
    ),
    "Reach": "Alcance",
    "How far a ray that meets nothing more is drawn": "Hasta dónde se dibuja un rayo que no encuentra nada más",
    "Seen Inside": "Ver dentro",
    "In a render, show the rays inside and behind an interface too, bent by it as anything else": (
        "Al procesar, muestra también los rayos dentro y detrás de una interfaz, refractados por ella como todo "
        "lo demás"
    ),
    "Draw Light Paths": "Dibujar trayectorias de rayos",
    "Shoot rays through the interfaces of this scene and draw where they go, by energy, in place of the last ones": (
        "Lanza rayos a través de las interfaces de esta escena y dibuja por dónde van, según su energía, en lugar "
        "de los anteriores"
    ),
    "Light paths are drawn in Object Mode only": "Las trayectorias de rayos solo se dibujan en el modo Objeto",
    "Light paths drawn; rays: {rays}, pieces: {pieces}": (
        "Trayectorias de rayos dibujadas; rayos: {rays}, tramos: {pieces}"
    ),
    "Rays end at {materials}: a link decides its media, so that they are not known here": (
        "Los rayos terminan en {materials}: un vínculo decide sus medios, y aquí no se conocen"
    ),
    "All rays end at an opaque object before they meet an interface; move it, or the source": (
        "Todos los rayos terminan en un objeto opaco antes de encontrar una interfaz; hay que moverlo, o mover el origen"
    ),
    "No ray met an interface; move the source, or aim it at one": (
        "Ningún rayo encontró una interfaz; hay que mover el origen, o apuntarlo a una"
    ),
    "After {bounces} bounces {share:.0f} % of the light ends at an interface; raise Bounces to follow it on": (
        "Tras {bounces} rebotes el {share:.0f} % de la luz termina en una interfaz; hay que aumentar Rebotes para "
        "seguirla"
    ),
    "Branches with {share:.0f} % of the light have less than the Least Energy; lower it to follow them on": (
        "Ramas con el {share:.0f} % de la luz tienen menos que la Energía mínima; hay que bajarla para seguirlas"
    ),
    "Clear Light Paths": "Eliminar trayectorias de rayos",
    "Remove all light paths of this scene, and what was made for them": (
        "Elimina todas las trayectorias de rayos de esta escena, y lo que se creó para ellas"
    ),
    "This scene has no light paths": "Esta escena no tiene trayectorias de rayos",
    "Light paths cleared": "Trayectorias de rayos eliminadas",
    "The scene has no camera": "La escena no tiene cámara",
    "Select a lamp": "Seleccionar una luz",
    "Light paths: no visible mesh of this scene has a NIM Interface material with media of its own; give one to an "
    "object first": (
        "Trayectorias de rayos: ninguna malla visible de esta escena tiene un material NIM Interface con medios "
        "propios; primero hay que dárselo a un objeto"
    ),
    "Light paths: the rays split into more than {most} pieces; take fewer rays or bounces, or a higher least energy": (
        "Trayectorias de rayos: los rayos se dividen en más de {most} tramos; hay que tomar menos rayos o "
        "rebotes, o una energía mínima mayor"
    ),
    "Light paths: no lamp is selected, and there is not just one; select a lamp": (
        "Trayectorias de rayos: no hay ninguna luz seleccionada, ni una sola en la escena; hay que seleccionar una"
    ),
    "Light paths: the scene has no camera; add one, or choose another source": (
        "Trayectorias de rayos: la escena no tiene cámara; hay que agregar una, o elegir otro origen"
    ),
    "Light paths: the direction of the rays is zero; give another, or choose another aim": (
        "Trayectorias de rayos: la dirección de los rayos es cero; hay que dar otra, o apuntar a otra cosa"
    ),
    # the preferences, and the check of this Blender
    "What new materials and scenes are made of": "De qué están hechos los materiales y escenas nuevos",
    "OSL where this Blender and the render device have it, else Blender's own nodes": (
        "OSL si este Blender y el dispositivo lo tienen; si no, los nodos propios de Blender"
    ),
    "The closure written in the Open Shading Language": "El cierre escrito en Open Shading Language",
    "The same optics in Blender's own nodes, for builds and devices without OSL": (
        "La misma óptica en nodos propios de Blender, para versiones y dispositivos sin OSL"
    ),
    "Samples": "Muestras",
    "Paths a pixel of new scenes": "Trayectorias por píxel de las escenas nuevas",
    "Renders": "Procesamiento",
    "Folder for headless renders; empty: renders beside the file, or in the home folder before it is saved": (
        "Carpeta para los procesamientos sin ventana; vacía: renders junto al archivo, o en la carpeta personal "
        "antes de guardarlo"
    ),
    "Check This Blender": "Comprobar este Blender",
    "See what this Blender has, and measure in a second one without a window whether it obeys the equations "
    "(seconds)": (
        "Muestra lo que tiene este Blender, y mide en otro sin ventana si obedece a las ecuaciones (segundos)"
    ),
    "The check is running": "La comprobación está en curso",
    "Measuring in a second Blender, some seconds...": "Midiendo en un segundo Blender, unos segundos...",
    "A second Blender could not be started: {reason}": "No se pudo iniciar un segundo Blender: {reason}",
    "The check did not run: {reason}": "La comprobación no se ejecutó: {reason}",
    "exit code {code}": "código de salida {code}",
    "PASS: {all} measurements agree with the equations": "CORRECTO: {all} medidas concuerdan con las ecuaciones",
    "FAIL: {failed} of {all} measurements differ from the equations": (
        "FALLO: {failed} de {all} medidas difieren de las ecuaciones"
    ),
    "landing point": "punto de llegada",
    "reflectance": "reflectancia",
    "{what} from {incident} to {transmitted} at {angle:g}°: {measured:.4f} measured, {equation:.4f} by the "
    "equation, {share:.0%} of the deviation allowed": (
        "{what} de {incident} a {transmitted} a {angle:g}°: {measured:.4f} medido, {equation:.4f} según la "
        "ecuación, {share:.0%} de la desviación permitida"
    ),
    "Materials use": "Los materiales usan",
    "Denoiser": "Reductor de ruido",
    "Devices": "Dispositivos",
    "Worst deviation": "Mayor desviación",
    # files of earlier versions
    "Update This File": "Actualizar este archivo",
    "Bring the interface node groups of this file up to the present version; every material keeps its values and "
    "links": (
        "Actualiza a la versión presente los grupos de nodos de interfaz de este archivo; cada material conserva "
        "sus valores y vínculos"
    ),
    "Every interface in this file is up to date": "Todas las interfaces de este archivo están al día",
    "Updated {names}": "Actualizado: {names}",
}
