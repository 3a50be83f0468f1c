#include <chrono>
#include "drv.hpp"
void setrate(Scene& s,const Structure& S,double per=0.4){s.rate=std::clamp(S.omega.maxCoeff()/per,20*lowest_of(S)/6.28,20000.0);}
std::string S(double x){char b[40];std::snprintf(b,40,"%.4g",x);return b;}
double size_of(const Structure& s){return s.mass_properties.r.colwise().norm().maxCoeff();}
Scene cloud(int n,unsigned seed,double lo=1e3,double hi=1e4){std::mt19937_64 g(seed);std::uniform_real_distribution<double>u(-1,1);Scene s;s.name="cl";
  while((int)s.points.size()<n){Vector3d p(1.5*u(g),0.8*u(g),0.6*u(g));bool ok=true;for(auto&q:s.points)ok=ok&&(q.position-p).norm()>0.6;if(ok)point(s,std::exp(0.7*u(g)),p);}
  for(int a=0;a<n;++a)for(int b=a+1;b<n;++b)link(s,{a,b},Spring{std::exp(0.5*(std::log(lo)+std::log(hi))+0.5*u(g)*std::log(hi/lo))});publish_all(s);return s;}
Scene chain(int n,double k,double kb){Scene s;s.name="s";for(int i=0;i<n;++i)point(s,1+0.2*i,Vector3d(i,0,0));for(int i=0;i+1<n;++i)link(s,{i,i+1},Spring{k});for(int i=0;i+2<n;++i)link(s,{i,i+1,i+2},BendingSpring{kb});publish_all(s);return s;}
TEST(G,feedback){for(double e:{0.0,0.01,0.05,0.2}){double kb=100,soft=3;Scene truth=chain(3,3e3,soft),s=chain(3,3e3,kb);
    auto S_=st(truth);double w1=lowest_of(*S_);auto S2=st(s);setrate(s,*S2);truth.rate=s.rate;
    add_mode(truth,*S_,0,1e-3,0);s.initial=truth.initial;
    double c[3]={1,-2,1};for(int p=0;p<3;++p)for(int q=0;q<3;++q){Feedback f;f.name="f"+std::to_string(3*p+q);f.point=p;f.sensor=q;f.displacement_gain=(kb-soft)*c[p]*c[q]*Vector3d(0,1,1).asDiagonal().toDenseMatrix();s.feedbacks.push_back(f);}
    Load L;L.axes=Axes::kBody;double F=e*soft*3;if(e>0){L.forces={{0,Vector3d(F,0,0)},{2,Vector3d(-F,0,0)}};truth.loads={L};s.loads={L};}
    study("feedback e "+S(e),truth,20*2*M_PI/w1,{Fidelity::kSeparated,Fidelity::kCoupled},25,&s);}}
// a strong dashpot locks two points: nothing of it decays
TEST(G,dashpot){for(unsigned seed:{0u,1u,2u})for(double c:{300.,1e4})for(double F:{3.,15.}){Scene s=cloud(5,seed+300,3e2,2e3);link(s,{0,1},Dashpot{c});
    auto S_=st(s);double w1=lowest_of(*S_);setrate(s,*S_);
    // ring: modes of the same with a stiff spring in the place of the dashpot
    Scene lock=cloud(5,seed+300,3e2,2e3);link(lock,{0,1},Spring{1e7});auto SL=st(lock);add_mode(s,*SL,0,1e-4,0);add_mode(s,*SL,1,1e-4,0);
    Load L;L.axes=Axes::kBody;Vector3d d=(s.points[3].position-s.points[2].position).normalized();L.forces={{2,F*0.1*d},{3,-F*0.1*d}};
    s.loads={L};
    {// start at the static answer
     int nm=SL->omega.size();for(int q=0;q<nm;++q){double x=0;for(auto&l:L.forces)x+=l.force.dot(S_->shapes.block<3,1>(3*l.point,q));add_mode(s,*S_,q,x/(S_->mass_properties.mass*S_->omega[q]*S_->omega[q]),0);} }
    s.tolerance=1e-4;
    study("dashpot seed"+S(seed)+" c "+S(c)+" F "+S(F)+" w "+S(SL->omega[0]),s,80*2*M_PI/w1,{Fidelity::kSeparated},25);}}
// the same phase error without the dashpot, for comparison
TEST(G,compare){for(unsigned seed:{0u,1u,2u})for(double F:{3.,15.}){Scene s=cloud(5,seed+300,3e2,2e3);link(s,{0,1},Spring{1e6});
    auto SL=st(s);double w1=lowest_of(*SL);setrate(s,*SL);add_mode(s,*SL,0,1e-4,0);add_mode(s,*SL,1,1e-4,0);
    Load L;L.axes=Axes::kBody;Vector3d d=(s.points[3].position-s.points[2].position).normalized();L.forces={{2,F*0.1*d},{3,-F*0.1*d}};s.loads={L};
    for(int q=0;q<SL->omega.size();++q){double x=0;for(auto&l:L.forces)x+=l.force.dot(SL->shapes.block<3,1>(3*l.point,q));add_mode(s,*SL,q,x/(SL->mass_properties.mass*SL->omega[q]*SL->omega[q]),0);}
    s.tolerance=1e-4;study("locked by a spring seed"+S(seed)+" F "+S(F),s,20*2*M_PI/w1,{Fidelity::kSeparated},25);}}
TEST(Z,tally){std::printf("TALLY scenes %d runs %d runs with false %d words %d good %d false %d silly runs %d\n",tally.scenes,tally.runs,tally.runs_fg,tally.words,tally.good,tally.false_good,tally.silly);}
